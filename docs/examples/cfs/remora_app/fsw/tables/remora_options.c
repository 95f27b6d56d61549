/* How to plan and to fly, as remora_defaults has it, from the learned model of fixtures/models/rk4.model. */
#include "cfe_tbl_filedef.h"
#include "remora_app_tbl.h"

#include <math.h>

REMORA_APP_OptionsTable_t OptionsTable = {
    .Crc = 0x0248,
    .Mode = REMORA_MODE_OPTIMAL,
    .Integrator = REMORA_INTEGRATOR_RK4,
    .Substeps = 8,
    .Deadline = 0.0,
    .ModelFile = "/cf/remora.model",
    .ModelCrc = 0xdf72,
    .Guidance = {
        .size = sizeof(RemoraGuidance),
        .reserved = 0,
        .com_bandwidth_rad_s = 0.04,
        .bus_bandwidth_rad_s = 0.06,
        .joint_bandwidth_rad_s = 0.4,
        .most_per_step_rad = 0.25,
        .integral = 0.2,
        .integral_limit_com_m = 0.05,
        .integral_limit_angle_rad = 0.05,
        .fade_plan_s = 20.0,
        .fade_turn_s = 120.0,
        .camera_bandwidth_rad_s = 0.05,
        .closing_distances_m = {0.085, 0.015},
        .closing_out_s = {350.0, 250.0},
        .closing_back_s = {{185.0, 45.0}, {100.0, 0.0}},
        .closing_settle_s = 25.0,
        .replan_age_s = INFINITY,
        .replan_com_m = INFINITY,
        .replan_bus_rad = INFINITY,
        .replan_target_rad = INFINITY,
        .replan_last_s = 0.0,
        .abort_settling_com_m = 0.25,
        .abort_settling_bus_rad = 0.25,
        .abort_settling_joint_rad = 0.25,
        .abort_settled_com_m = 0.06,
        .abort_settled_bus_rad = 0.1,
        .abort_settled_joint_rad = 0.1,
        .abort_settles_s = 200.0,
        .abort_near_com_m = 0.012,
        .abort_near_bus_rad = 0.1,
        .abort_near_joint_rad = 0.05,
        .abort_near_times_s = {400.0, 105.0},
        .abort_port_m = 0.012,
    },
};

CFE_TBL_FILEDEF(OptionsTable, REMORA_APP.Options, Options of Remora, remora_options.tbl)
