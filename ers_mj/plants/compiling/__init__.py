"""What numba makes of the kernels: compiled (units called by symbol, laws by address), each kept by its digest in
code_folder, told and cleared by kept_code.
"""
