/* Plans what it reads, a line each: mode, integrator, substeps, model (0 or 1), then attitude and rate of the
 * target, position and velocity. Prints the checksum of each plan, and that the verifier agrees again.
 * Usage: golden MODEL_EULER MODEL_RK4 */
#include <inttypes.h>
#include <remora.h>
#include <stdio.h>

static unsigned char memory[REMORA_WORKSPACE_BYTES + REMORA_ALIGNMENT - 1];
static unsigned char models[2][500000];
static size_t lengths[2];

static int read_model(const char *path, int which) {
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return 0;
    }
    lengths[which] = fread(models[which], 1, sizeof models[which], file);
    fclose(file);
    return lengths[which] > 0 && lengths[which] < sizeof models[which];
}

/* One plan of the scenario and options; whether all is as it must be. */
static int plan(void *workspace, const RemoraScenario *scenario, const RemoraOptions *options) {
    RemoraReport report;
    RemoraVerification found;
    RemoraRecord record;
    RemoraStatus status;
    report.size = sizeof report;
    found.size = sizeof found;
    record.size = sizeof record;
    status = remora_plan(workspace, scenario, options, &report);
    if (status == REMORA_STATUS_OK) {
        status = remora_verify(workspace, &found);
    }
    if (status == REMORA_STATUS_OK) {
        status = remora_record(workspace, &record);
    }
    if (status != REMORA_STATUS_OK) {
        printf("%s\n", remora_strerror(status));
        return 0;
    }
    printf("%016" PRIx64 "\n", report.checksum);
    return record.output == report.checksum && found.is_verified == report.is_verified;
}

int main(int count, char **arguments) {
    void *workspace = REMORA_ALIGN(memory);
    RemoraMission mission;
    RemoraScenario s;
    RemoraOptions options;
    uint32_t mode, integrator, learned;
    int is_sound = 1;
    if (count != 3 || !read_model(arguments[1], 1) || !read_model(arguments[2], 0) ||
        remora_defaults(REMORA_ABI, &mission, &s, &options, NULL) != REMORA_STATUS_OK ||
        remora_open(workspace, REMORA_WORKSPACE_BYTES, REMORA_ABI, &mission) != REMORA_STATUS_OK) {
        return 2;
    }
    while (scanf("%" SCNu32 "%" SCNu32 "%" SCNu32 "%" SCNu32 "%lf%lf%lf%lf%lf%lf%lf%lf%lf%lf%lf%lf%lf",
                 &mode, &integrator, &options.substeps, &learned,
                 &s.target_attitude_body_to_rtn[0], &s.target_attitude_body_to_rtn[1],
                 &s.target_attitude_body_to_rtn[2], &s.target_attitude_body_to_rtn[3],
                 &s.target_rate_body_rad_s[0], &s.target_rate_body_rad_s[1], &s.target_rate_body_rad_s[2],
                 &s.com_position_rtn_m[0], &s.com_position_rtn_m[1], &s.com_position_rtn_m[2],
                 &s.com_velocity_rtn_m_s[0], &s.com_velocity_rtn_m_s[1], &s.com_velocity_rtn_m_s[2]) == 17) {
        options.mode = (RemoraMode)mode;
        options.integrator = (RemoraIntegrator)integrator;
        options.model = learned ? models[integrator] : NULL;
        options.model_bytes = learned ? lengths[integrator] : 0;
        is_sound = plan(workspace, &s, &options) && is_sound;
    }
    return is_sound ? 0 : 1;
}
