"""The main job: recordings in, the missing physics out.

pipeline (the job) -> case (what is known in the end; the verdict's rules: decisions/verdict.py) -> document
loop/ does the same for a servo that is told a position; errors_told names the errors for both kinds of case
document: sentences, record_state, views, evidence; where: localisation, mismatch_spectrum; mujoco_check: the twin
"""
