/* Plans an approach, prints its nodes, flies some steps of guidance along it and prints the plan's checksum.
 * Usage: plan [euler] */
#include <inttypes.h>
#include <remora.h>
#include <stdio.h>
#include <string.h>

static unsigned char workspace_memory[REMORA_WORKSPACE_BYTES + REMORA_ALIGNMENT - 1];
static unsigned char flight_memory[REMORA_FLIGHT_BYTES + REMORA_ALIGNMENT - 1];

/* Says what went wrong; whether something did. */
static int failed(const char *what, RemoraStatus status) {
    if (status != REMORA_STATUS_OK) {
        fprintf(stderr, "%s: %s\n", what, remora_strerror(status));
    }
    return status != REMORA_STATUS_OK;
}

int main(int count, char **arguments) {
    void *workspace = REMORA_ALIGN(workspace_memory), *flight = REMORA_ALIGN(flight_memory);
    RemoraMission mission;
    RemoraScenario scenario;
    RemoraOptions options;
    RemoraReport report;
    uint32_t k;
    int step;

    if (failed("defaults", remora_defaults(REMORA_ABI, &mission, &scenario, &options, NULL)) ||
        failed("open", remora_open(workspace, REMORA_WORKSPACE_BYTES, REMORA_ABI, &mission))) {
        return 2;
    }
    scenario.target_rate_body_rad_s[0] = 2.0e-4;
    scenario.target_rate_body_rad_s[2] = 1.0e-3;
    scenario.com_position_rtn_m[0] = 8.0;
    scenario.com_position_rtn_m[2] = 0.0;
    if (count > 1 && strcmp(arguments[1], "euler") == 0) {
        options.integrator = REMORA_INTEGRATOR_EULER;
    }
    report.size = sizeof report;
    if (failed("plan", remora_plan(workspace, &scenario, &options, &report))) {
        return 1;
    }
    for (k = 0; k < report.nodes; k++) {
        RemoraNode node;
        node.size = sizeof node;
        if (failed("node", remora_node(workspace, k, &node))) {
            return 1;
        }
        printf("%4.0f s  x %8.4f m  joint 1 %8.5f rad  bus torque %10.3e N m\n", node.time_s,
               node.com_position_rtn_m[0], node.joint_angle_rad[0], node.bus_torque_body_n_m[0]);
    }
    /* A plan made with Euler's step says nothing between its nodes: nobody flies it. */
    if (options.integrator == REMORA_INTEGRATOR_RK4 &&
        (failed("fly", remora_fly(flight, REMORA_FLIGHT_BYTES, REMORA_ABI, NULL)) ||
         failed("flight plan", remora_flight_plan(workspace, 0.0, flight)))) {
        return 1;
    }
    for (step = 0; options.integrator == REMORA_INTEGRATOR_RK4 && step < 5; step++) {
        RemoraEstimate estimate; /* navigation's; here a servicer that is 1 cm off what guidance expects */
        RemoraCommand command;
        estimate.size = sizeof estimate;
        command.size = sizeof command;
        if (failed("estimate", remora_expected(flight, 300.0 + step, &estimate))) {
            return 1;
        }
        estimate.bus_position_rtn_m[1] += 0.01;
        if (failed("guide", remora_guide(flight, &estimate, NULL, &command))) {
            return 1;
        }
        printf("mode %" PRIu32 "  force %10.6f %10.6f %10.6f N\n", (uint32_t)command.mode,
               command.bus_force_rtn_n[0], command.bus_force_rtn_n[1], command.bus_force_rtn_n[2]);
    }
    printf("verified %" PRIu32 "  checksum %016" PRIx64 "\n", report.is_verified, report.checksum);
    return report.is_verified ? 0 : 3;
}
