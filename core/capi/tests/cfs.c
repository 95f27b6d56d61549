/* The app for the core Flight System against the stub of cfe.h: start-up, commands, plan, file, flight, planning
 * again, tables and models that are damaged. Prints the checksums of two plans of the first public scenario, from
 * the model and from the heuristic.
 * Usage: cfs FOLDER, which holds cf/remora.model; cfs FOLDER bad-table */
#define _POSIX_C_SOURCE 200809L
#include "cfe_stub/stub.h"
#include "remora_app.h"
#include "scenarios.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

extern REMORA_APP_MissionTable_t MissionTable;
extern REMORA_APP_OptionsTable_t OptionsTable;

#define CHECK(condition) \
    ((condition) ? (void)0 : (fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition), exit(1)))

/* A message of any kind, aligned as on the bus. */
static union {
    CFE_SB_Buffer_t Buffer;
    REMORA_APP_NoArgsCmd_t NoArgs;
    REMORA_APP_PlanCmd_t Plan;
    REMORA_APP_TimeCmd_t Time;
    REMORA_APP_EstimateMsg_t Estimate;
} message;

static void send(CFE_SB_MsgId_Atom_t id, CFE_MSG_FcnCode_t code, size_t size) {
    StubSend(&message.Buffer.Msg, id, code, size);
}
static void command(CFE_MSG_FcnCode_t code) { send(REMORA_APP_CMD_MID, code, sizeof message.NoArgs); }
static void command_at(CFE_MSG_FcnCode_t code, double time) {
    message.Time.Time = time;
    send(REMORA_APP_CMD_MID, code, sizeof message.Time);
}
static void plan(const RemoraScenario *scenario) {
    message.Plan.Scenario = *scenario;
    send(REMORA_APP_CMD_MID, REMORA_APP_PLAN_CC, sizeof message.Plan);
}
static const REMORA_APP_HkTlm_Payload_t *housekeeping(void) {
    send(REMORA_APP_SEND_HK_MID, 0, sizeof message.NoArgs);
    CHECK(StubLast(REMORA_APP_HK_TLM_MID) != NULL);
    return &((const REMORA_APP_HkTlm_t *)StubLast(REMORA_APP_HK_TLM_MID))->Payload;
}
static const REMORA_APP_HkTlm_Payload_t *planned(void) {
    const REMORA_APP_HkTlm_Payload_t *hk = housekeeping();
    while (hk->State == REMORA_APP_PLANNING || hk->State == REMORA_APP_DONE) {
        hk = housekeeping();
    }
    return hk;
}

/* What navigation would say: from a flight of the same plan, that is the test's own. */
static unsigned char workspace_memory[REMORA_WORKSPACE_BYTES + REMORA_ALIGNMENT - 1];
static unsigned char flight_memory[REMORA_FLIGHT_BYTES + REMORA_ALIGNMENT - 1];

static void make_expectation(const RemoraScenario *scenario, double begins) {
    void *workspace = REMORA_ALIGN(workspace_memory), *flight = REMORA_ALIGN(flight_memory);
    RemoraOptions options;
    RemoraReport report;
    report.size = sizeof report;
    remora_defaults(REMORA_ABI, NULL, NULL, &options, NULL);
    CHECK(remora_open(workspace, REMORA_WORKSPACE_BYTES, REMORA_ABI, &MissionTable.Mission) == REMORA_STATUS_OK);
    CHECK(remora_plan(workspace, scenario, &options, &report) == REMORA_STATUS_OK);
    CHECK(remora_fly(flight, REMORA_FLIGHT_BYTES, REMORA_ABI, NULL) == REMORA_STATUS_OK);
    CHECK(remora_flight_plan(workspace, begins, flight) == REMORA_STATUS_OK);
}
static void estimate_at(double time) {
    RemoraEstimate *estimate = &message.Estimate.Estimate;
    estimate->size = sizeof *estimate;
    CHECK(remora_expected(REMORA_ALIGN(flight_memory), time, estimate) == REMORA_STATUS_OK);
    send(REMORA_APP_ESTIMATE_MID, 0, sizeof message.Estimate);
}
static void wake_up(void) { send(REMORA_APP_WAKEUP_MID, 0, sizeof message.NoArgs); }
static void step_at(double time) {
    estimate_at(time);
    wake_up();
}

static uint32 crc(const void *table, size_t size) {
    return CFE_ES_CalculateCRC((const uint32 *)table + 1, size - 4, 0, CFE_MISSION_ES_DEFAULT_CRC);
}
/* The options, changed: the app takes them with the next request for housekeeping. */
static void load_options(void) {
    OptionsTable.Crc = crc(&OptionsTable, sizeof OptionsTable);
    StubLoadTable(&StubFile_OptionsTable);
    (void)housekeeping();
}

/* Whether a structure of a table is the default; says which number is not. */
static bool is_default(const char *name, const void *table, const void *defaults, size_t size) {
    const double *has = table, *should = defaults;
    size_t i;
    for (i = 0; i < size / sizeof(double); i++) {
        if (memcmp(&has[i], &should[i], sizeof(double)) != 0) {
            fprintf(stderr, "%s, byte %lu: %.17g, remora_defaults says %.17g\n", name,
                    (unsigned long)(i * sizeof(double)), has[i], should[i]);
        }
    }
    return memcmp(table, defaults, size) == 0;
}

/* The tables that are checked in: what remora_defaults says, with their checksums. */
static void check_tables(void) {
    RemoraMission mission;
    RemoraOptions options;
    RemoraGuidance guidance;
    remora_defaults(REMORA_ABI, &mission, NULL, &options, &guidance);
    CHECK(is_default("mission", &MissionTable.Mission, &mission, sizeof mission));
    CHECK(is_default("guidance", &OptionsTable.Guidance, &guidance, sizeof guidance));
    CHECK(OptionsTable.Mode == options.mode && OptionsTable.Integrator == options.integrator);
    CHECK(OptionsTable.Substeps == options.substeps);
    printf("Mission 0x%04" PRIx32 " Options 0x%04" PRIx32 "\n", crc(&MissionTable, sizeof MissionTable),
           crc(&OptionsTable, sizeof OptionsTable));
    CHECK(MissionTable.Crc == crc(&MissionTable, sizeof MissionTable));
    CHECK(OptionsTable.Crc == crc(&OptionsTable, sizeof OptionsTable));
}

static RemoraScenario first_scenario(void) {
    RemoraScenario scenario;
    remora_defaults(REMORA_ABI, NULL, &scenario, NULL, NULL);
    memcpy(scenario.target_attitude_body_to_rtn, SCENARIOS[0].attitude, sizeof scenario.target_attitude_body_to_rtn);
    memcpy(scenario.target_rate_body_rad_s, SCENARIOS[0].rate, sizeof scenario.target_rate_body_rad_s);
    memcpy(scenario.com_position_rtn_m, SCENARIOS[0].position, sizeof scenario.com_position_rtn_m);
    memcpy(scenario.com_velocity_rtn_m_s, SCENARIOS[0].velocity, sizeof scenario.com_velocity_rtn_m_s);
    return scenario;
}

static void check_commands(void) {
    CHECK(StubEvents(REMORA_APP_STARTUP_INF_EID) == 1);
    command(REMORA_APP_NOOP_CC);
    CHECK(StubEvents(REMORA_APP_NOOP_INF_EID) == 1 && housekeeping()->CommandCounter == 1);
    command(99);
    CHECK(StubEvents(REMORA_APP_CC_ERR_EID) == 1);
    command(REMORA_APP_PLAN_CC); /* without a scenario */
    CHECK(StubEvents(REMORA_APP_LEN_ERR_EID) == 1 && housekeeping()->CommandErrorCounter == 2);
    command_at(REMORA_APP_FLY_CC, 0.0);
    CHECK(StubEvents(REMORA_APP_FLY_ERR_EID) == 1);
    command(REMORA_APP_RESET_COUNTERS_CC);
    CHECK(housekeeping()->CommandCounter == 0 && housekeeping()->CommandErrorCounter == 0);
    command(REMORA_APP_SELF_TEST_CC);
    CHECK(planned()->SelfTestChecksum == REMORA_SELF_TEST_RK4);
    CHECK(StubEvents(REMORA_APP_SELF_TEST_INF_EID) == 1);
}

/* The plan's file: header, report, record, residuals, nodes; the checksum of the record. */
static void check_file(uint64 checksum) {
    static unsigned char bytes[65536];
    char name[512];
    RemoraRecord record;
    size_t length, at = sizeof(CFE_FS_Header_t) + sizeof(RemoraReport);
    FILE *file;
    snprintf(name, sizeof name, "%s%s", StubFolder, REMORA_APP_UNFINISHED_FILE);
    CHECK(fopen(name, "rb") == NULL);
    snprintf(name, sizeof name, "%s%s", StubFolder, REMORA_APP_PLAN_FILE);
    file = fopen(name, "rb");
    CHECK(file != NULL);
    length = fread(bytes, 1, sizeof bytes, file);
    fclose(file);
    CHECK(length == at + sizeof record + sizeof(RemoraVerification) + 60 * sizeof(RemoraNode));
    memcpy(&record, bytes + at, sizeof record);
    CHECK(record.output == checksum);
}

static void check_plans(const RemoraScenario *scenario) {
    const REMORA_APP_HkTlm_Payload_t *hk;
    RemoraScenario inside = *scenario;
    plan(scenario);
    plan(scenario); /* it plans already */
    CHECK(StubEvents(REMORA_APP_BUSY_ERR_EID) == 1);
    hk = planned();
    CHECK(hk->Plans == 1 && hk->PlanStatus == REMORA_STATUS_OK && hk->Verdict == REMORA_VERDICT_OPTIMAL);
    CHECK(hk->LastSeconds > 0.0 && hk->LastSeconds == hk->MeanSeconds && hk->LastSeconds == hk->LongestSeconds);
    check_file(hk->Checksum);
    printf("plan %016" PRIx64 "\n", hk->Checksum);
    /* A start within the keep-out distance; and one that is no number. */
    inside.com_position_rtn_m[0] = inside.com_position_rtn_m[1] = inside.com_position_rtn_m[2] = 0.5;
    plan(&inside);
    CHECK(planned()->PlanStatus == REMORA_STATUS_REFUSED && StubEvents(REMORA_APP_PLAN_ERR_EID) == 1);
    command_at(REMORA_APP_FLY_CC, 0.0);
    CHECK(StubEvents(REMORA_APP_FLY_ERR_EID) == 2);
    inside.com_position_rtn_m[0] = NAN;
    plan(&inside);
    CHECK(planned()->PlanStatus == REMORA_STATUS_NOT_FINITE);
    /* A model that is not the table's: the heuristic serves. */
    OptionsTable.ModelCrc ^= 1;
    load_options();
    plan(scenario);
    hk = planned();
    CHECK(StubEvents(REMORA_APP_MODEL_ERR_EID) == 1 && hk->Plans == 2);
    printf("plan %016" PRIx64 "\n", hk->Checksum);
    OptionsTable.ModelCrc ^= 1;
    load_options();
}

static void check_flight(const RemoraScenario *scenario) {
    const REMORA_APP_CommandMsg_t *out;
    const struct timespec pause = {0, 20000000};
    uint32 steps, during = 0;
    double now = 0.0;
    int i;
    make_expectation(scenario, 100.0);
    plan(scenario);
    CHECK(planned()->IsFlying == 0);
    command_at(REMORA_APP_FLY_CC, 100.0);
    CHECK(housekeeping()->State == REMORA_APP_WAITING);
    plan(scenario); /* the plan that waits is not to be lost */
    CHECK(StubEvents(REMORA_APP_BUSY_ERR_EID) == 2);
    step_at(99.9);
    CHECK(StubLast(REMORA_APP_COMMAND_MID) == NULL && housekeeping()->IsFlying == 0);
    for (i = 0; i < 10; i++) {
        step_at(100.0 + 0.1 * i);
    }
    CHECK(StubEvents(REMORA_APP_FLY_INF_EID) == 1 && housekeeping()->Steps == 10);
    out = StubLast(REMORA_APP_COMMAND_MID);
    CHECK(out != NULL && out->Command.size == sizeof out->Command && out->Command.mode == REMORA_FLIGHT_MODE_TRACK);
    CHECK(housekeeping()->TrackingError[0] < 1.0e-2);
    wake_up();
    CHECK(housekeeping()->Missed == 1 && housekeeping()->Steps == 10);
    CHECK(StubEvents(REMORA_APP_MISSED_ERR_EID) == 1);

    /* Planning again: guidance goes on meanwhile, at 20 Hz of its own clock. */
    command_at(REMORA_APP_REPLAN_CC, 20.0);
    for (steps = 0; housekeeping()->State == REMORA_APP_PLANNING; steps++) {
        now = 101.0 + 0.05 * steps;
        step_at(now);
        during++;
        nanosleep(&pause, NULL);
    }
    CHECK(during > 0 && planned()->State == REMORA_APP_WAITING && housekeeping()->Steps == 10 + during);
    for (now += 1.0; now < 118.0; now += 4.0) {
        step_at(now);
    }
    step_at(119.0);
    CHECK(StubEvents(REMORA_APP_FLY_INF_EID) == 1 && housekeeping()->GuideStatus == REMORA_STATUS_OK);
    step_at(122.0);
    CHECK(StubEvents(REMORA_APP_FLY_INF_EID) == 2 && housekeeping()->State == REMORA_APP_IDLE);
    CHECK(housekeeping()->Mode == REMORA_FLIGHT_MODE_TRACK && housekeeping()->GuideStatus == REMORA_STATUS_OK);

    estimate_at(122.1);
    message.Estimate.Estimate.bus_position_rtn_m[0] = NAN;
    send(REMORA_APP_ESTIMATE_MID, 0, sizeof message.Estimate);
    wake_up();
    CHECK(housekeeping()->Mode == REMORA_FLIGHT_MODE_DEGRADED);
    command(REMORA_APP_ABORT_CC);
    step_at(122.2);
    CHECK(housekeeping()->Mode == REMORA_FLIGHT_MODE_ABORT && StubEvents(REMORA_APP_LEAVING_INF_EID) == 1);
}

static void check_new_tables(const RemoraScenario *scenario) {
    uint64 checksum = housekeeping()->Checksum;
    MissionTable.Mission.bus_mass_kg = 510.0;
    StubLoadTable(&StubFile_MissionTable);
    (void)housekeeping();
    CHECK(StubEvents(REMORA_APP_TABLE_ERR_EID) == 1);
    MissionTable.Crc = crc(&MissionTable, sizeof MissionTable);
    StubLoadTable(&StubFile_MissionTable);
    (void)housekeeping();
    CHECK(StubEvents(REMORA_APP_TABLE_ERR_EID) == 1);
    plan(scenario);
    CHECK(planned()->PlanStatus == REMORA_STATUS_OK && housekeeping()->Checksum != checksum);
}

int main(int count, char **arguments) {
    RemoraScenario scenario = first_scenario();
    CHECK(count >= 2);
    StubFolder = arguments[1];
    if (count == 3) {
        MissionTable.Mission.duration_s += 1.0;
        StubStart(REMORA_APP_Main);
        CHECK(StubStop() == CFE_ES_RunStatus_APP_ERROR && StubEvents(REMORA_APP_TABLE_ERR_EID) == 1);
        return 0;
    }
    check_tables();
    StubStart(REMORA_APP_Main);
    OptionsTable.Substeps = 4;
    load_options();
    check_commands();
    check_plans(&scenario);
    check_flight(&scenario);
    check_new_tables(&scenario);
    CHECK(StubStop() == CFE_ES_RunStatus_APP_ERROR && StubEvents(REMORA_APP_PIPE_ERR_EID) == 1);
    return 0;
}
