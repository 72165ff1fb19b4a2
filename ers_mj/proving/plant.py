"""The independent servo in numbers: the record that its compiled laws read, and its states.

All on the rudder side of the gear, angles rad, torques N m, voltages V, currents A, times s.
"""

from __future__ import annotations

import numpy as np

DEG = np.pi / 180.0

TABLE_1 = {
    "J": 0.0031,
    "B": 0.0098,
    "K_t": 0.0175,
    "K_e": 0.0295,
    "k_s": 0.0877,
    "T_LH": 0.46,
    "F_c": 0.34,
    "R": 1.55,
    "L": 0.0016,
    "theta_0": 0.261799,
    "n": 22.26,
}
"""Table 1 of the paper, SI."""

FIELDS = """J B K_t K_e k_s T_LH F_c R L theta_0 n share_J share_B share_F
    stri_f stri_v stri_form asym_c asym_v asym_dir load_mu load_form quad_c quad_p pos_a pos_k pos_ph pos_form
    pre_s0 pre_s1 pre_vd pre_delta
    two gap con_k con_c con_form ratio_s ratio_form ratio_a ratio_b rip_a rip_k rip_ph rip_h2 cog_a cog_k cog_ph cog_h2
    sat_V sat_p lim_A lim_form dead_V dead_form delay_s th_R th_tau th_alpha th_beta th_fast sag_R sag_tau sag_V
    sag_form bias grav grav_ph k3 k3_form stop_hi stop_lo stop_k stop_c stop_form
    dist_T dist_t0 dist_d dist_form gust_T gust_w gust_ph gust_form
    lag_s lag_form nl_a nl_P nl_ph nl_form q_step q_form adc_step
    app_J app_k app_c bw_T bw_x bw_n age_a age_t0 age_D brush_V brush_i angdamp_a angdamp_P tacho_a tacho_ph
    kt_sat mxw_k mxw_tau run_a run_D L_sat rod torque quasi grav_k""".split()
PLANT = np.dtype([(name, "f8") for name in FIELDS])
"""Everything that the compiled code reads, one number a field; zero means absent."""

CONTROLLER = ("KP", "KI", "KD", "TF", "UMAX", "FF_ON", "FF_C", "FF_TLH", "FF_KS", "FF_TH0", "D_ON_Y")
"""PID on the measured angle [V/rad, V/(rad s), V s/rad, s, V], feed-forward of spring and preload [V/(N m), N m, N
m/rad, rad]; D_ON_Y 1: the derivative is that of the angle alone, not of the error.
"""

TH, W, CUR, THM, WM, BRI, HYS, APP, APV, TEMP, FAST, BUS, LAG, MXW, AGE, RUN = range(16)
STATES = RUN + 1


def plant_of(params):
    """The compiled code's record for Eq. (1) with `params` (Table 1's letters, SI) and no effect."""
    plant = np.zeros(1, PLANT)
    for name, value in {**TABLE_1, **params}.items():
        field = {"motor_inertia_share": "share_J", "motor_damping_share": "share_B"}.get(name, name)
        plant[field] = value
    for name in ("share_J", "share_B"):
        if plant[name][0] == 0.0:
            plant[name] = 0.5
    for name in (
        "stri_v",
        "bw_x",
        "brush_i",
        "age_t0",
        "age_D",
        "run_D",
        "angdamp_P",
        "mxw_tau",
        "nl_P",
        "quad_p",
        "pre_delta",
        "grav_k",
    ):
        plant[name] = 1.0
    plant["stop_hi"], plant["stop_lo"] = 1e9, -1e9
    plant["sag_V"] = 24.0
    return plant
