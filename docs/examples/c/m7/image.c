/* Plans, guides and plans again without an operating system, and prints a checksum of all that comes of it.
 * Scenarios FIRST to LAST - 1 of scenarios.h, with both integrators, from the heuristic and from a model. The
 * board says where text goes: start.c is a Cortex-M7. docs/guides/c.md tells how the image is built and run. */
#include "board.h"
#include "scenarios.h"
#include <remora.h>

#ifndef FIRST
#define FIRST 0
#endif
#ifndef LAST
#define LAST 1
#endif

/* The models' files, in flash: models.S. */
extern const unsigned char model_euler[], model_euler_end[], model_rk4[], model_rk4_end[];

static unsigned char workspace_memory[REMORA_WORKSPACE_BYTES + REMORA_ALIGNMENT - 1];
static unsigned char flight_memory[REMORA_FLIGHT_BYTES + REMORA_ALIGNMENT - 1];
static RemoraMission mission;
static RemoraScenario scenario;
static RemoraOptions options;

/* Sends a line: words, then a number's sixteen digits. */
static void write_line(const char *what, const char *which, uint64_t number) {
    char digits[18];
    int i;
    for (i = 0; i < 16; i++) {
        digits[i] = "0123456789abcdef"[(number >> (60 - 4 * i)) & 15];
    }
    digits[16] = '\n';
    digits[17] = '\0';
    board_write(what);
    board_write(which);
    board_write(" ");
    board_write(digits);
}

/* Says what went wrong; whether something did. */
static int failed(const char *what, RemoraStatus status) {
    if (status != REMORA_STATUS_OK) {
        board_write(what);
        board_write(": ");
        board_write(remora_strerror(status));
        board_write("\n");
    }
    return status != REMORA_STATUS_OK;
}

/* Whether compiler, processor and memory are what they were tested to be. */
static int self_test_fails(void *workspace) {
    uint64_t euler, rk4;
    if (failed("self-test euler", remora_self_test(workspace, REMORA_INTEGRATOR_EULER, &euler)) ||
        failed("self-test rk4", remora_self_test(workspace, REMORA_INTEGRATOR_RK4, &rk4))) {
        return 1;
    }
    write_line("self-test", " euler", euler);
    write_line("self-test", " rk4", rk4);
    return euler != REMORA_SELF_TEST_EULER || rk4 != REMORA_SELF_TEST_RK4;
}

/* Plans the scenario with an integrator, from a model where one is given. */
static int plan_fails(void *workspace, const char *id, const char *how, const unsigned char *model,
                      const unsigned char *end) {
    RemoraReport report;
    report.size = sizeof report;
    options.model = model;
    options.model_bytes = (size_t)(end - model);
    if (failed("plan", remora_plan(workspace, &scenario, &options, &report))) {
        return 1;
    }
    write_line(id, how, report.checksum);
    return 0;
}

/* Plans scenario i in all four ways; the last plan can be flown. */
static int scenario_fails(void *workspace, int i) {
    const char *id = SCENARIOS[i].id;
    int k;
    for (k = 0; k < 3; k++) {
        scenario.target_rate_body_rad_s[k] = SCENARIOS[i].rate[k];
        scenario.com_position_rtn_m[k] = SCENARIOS[i].position[k];
        scenario.com_velocity_rtn_m_s[k] = SCENARIOS[i].velocity[k];
    }
    for (k = 0; k < 4; k++) {
        scenario.target_attitude_body_to_rtn[k] = SCENARIOS[i].attitude[k];
    }
    options.integrator = REMORA_INTEGRATOR_EULER;
    if (plan_fails(workspace, id, " euler heuristic", NULL, NULL) ||
        plan_fails(workspace, id, " euler model", model_euler, model_euler_end)) {
        return 1;
    }
    options.integrator = REMORA_INTEGRATOR_RK4;
    return plan_fails(workspace, id, " rk4 heuristic", NULL, NULL) ||
           plan_fails(workspace, id, " rk4 model", model_rk4, model_rk4_end);
}

/* FNV-1a of a command's bytes. */
static uint64_t checksum(const RemoraCommand *command) {
    const unsigned char *byte = (const unsigned char *)command, *end = byte + sizeof *command;
    uint64_t sum = 0xcbf29ce484222325ull;
    for (; byte < end; byte++) {
        sum = (sum ^ *byte) * 0x100000001b3ull;
    }
    return sum;
}

/* Some steps of guidance at a fixed interval [s]; the servicer is 1 cm off what guidance expects. */
static int steps_fail(void *flight, double begins, int steps, double period, RemoraEstimate *estimate) {
    RemoraCommand command;
    int step;
    command.size = sizeof command;
    for (step = 0; step < steps; step++) {
        if (failed("estimate", remora_expected(flight, begins + period * step, estimate))) {
            return 1;
        }
        estimate->bus_position_rtn_m[1] += 0.01;
        if (failed("guide", remora_guide(flight, estimate, NULL, &command))) {
            return 1;
        }
        write_line("guide", "", checksum(&command));
    }
    return 0;
}

/* Flies the plan in the workspace, plans what is left again, and flies that. */
static int flight_fails(void *workspace, void *flight) {
    RemoraEstimate estimate;
    RemoraReport report;
    estimate.size = sizeof estimate;
    report.size = sizeof report;
    if (failed("fly", remora_fly(flight, REMORA_FLIGHT_BYTES, REMORA_ABI, NULL)) ||
        failed("flight plan", remora_flight_plan(workspace, 0.0, flight)) ||
        steps_fail(flight, 300.0, 8, 0.1, &estimate) ||
        failed("replan", remora_replan(workspace, flight, &estimate, 20.0, &options, &report))) {
        return 1;
    }
    write_line("replan", "", report.checksum);
    /* Along the plan in force until the new one begins. */
    return steps_fail(flight, 301.0, 4, 5.0, &estimate) ||
           failed("flight plan", remora_flight_plan(workspace, report.begins_s, flight)) ||
           steps_fail(flight, report.begins_s, 8, 0.1, &estimate);
}

int image(void) {
    void *workspace = REMORA_ALIGN(workspace_memory), *flight = REMORA_ALIGN(flight_memory);
    int i;
    if (failed("defaults", remora_defaults(REMORA_ABI, &mission, &scenario, &options, NULL)) ||
        failed("open", remora_open(workspace, REMORA_WORKSPACE_BYTES, REMORA_ABI, &mission)) ||
        self_test_fails(workspace)) {
        return 1;
    }
    options.substeps = 4;
    for (i = FIRST; i < LAST; i++) {
        if (scenario_fails(workspace, i)) {
            return 1;
        }
    }
    return flight_fails(workspace, flight);
}
