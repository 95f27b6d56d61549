/* How to plan and to fly, as remora_defaults has it, from the learned model of fixtures/models/rk4.model. */
#include "cfe_tbl_filedef.h"
#include "remora_app_tbl.h"

#include <math.h>

REMORA_APP_OptionsTable_t OptionsTable = {
    .Crc = 0x0248,
    .Mode = REMORA_OPTIMAL,
    .Integrator = REMORA_RK4,
    .Substeps = 8,
    .Deadline = 0.0,
    .ModelFile = "/cf/remora.model",
    .ModelCrc = 0xdf72,
    .Guidance = {
        .size = sizeof(RemoraGuidance),
        .reserved = 0,
        .bandwidth = {0.04, 0.06, 0.4},
        .most_per_step = 0.25,
        .integral = 0.2,
        .integral_limit = {0.05, 0.05},
        .fade = {20.0, 120.0},
        .camera = 0.05,
        .closing_distances = {0.085, 0.015},
        .closing_out = {350.0, 250.0},
        .closing_back = {{185.0, 45.0}, {100.0, 0.0}},
        .closing_settle = 25.0,
        .replan_age = INFINITY,
        .replan_position = INFINITY,
        .replan_attitude = INFINITY,
        .replan_target = INFINITY,
        .replan_last = 0.0,
        .abort_settling = {0.25, 0.25, 0.25},
        .abort_settled = {0.06, 0.1, 0.1},
        .abort_settles = 200.0,
        .abort_near = {0.012, 0.1, 0.05},
        .abort_near_times = {400.0, 105.0},
        .abort_port = 0.012,
    },
};

CFE_TBL_FILEDEF(OptionsTable, REMORA_APP.Options, Options of Remora, remora_options.tbl)
