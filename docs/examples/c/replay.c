/* Plans again what `cargo xtask replay` hands to it, and prints the plan's checksum.
 * On standard input, a line each: the members of RemoraMission and of RemoraScenario after their sizes, then mode,
 * integrator and substeps. A number with a point or an exponent is a double, any other a 32-bit integer.
 * Usage: replay [MODEL] <INPUT */
#include <inttypes.h>
#include <remora.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static unsigned char memory[REMORA_WORKSPACE_BYTES + REMORA_ALIGNMENT - 1];
static unsigned char model[4000000];

/* Fills a structure after its size with what it reads. */
static int fill(void *structure, uint32_t size) {
    unsigned char *at = structure, *end = at + size;
    char word[64];
    memcpy(at, &size, sizeof size);
    at += sizeof size;
    while (at < end && scanf("%63s", word) == 1) {
        if (strpbrk(word, ".e") != NULL) {
            double number = strtod(word, NULL);
            memcpy(at, &number, sizeof number);
            at += sizeof number;
        } else {
            uint32_t number = (uint32_t)strtoul(word, NULL, 10);
            memcpy(at, &number, sizeof number);
            at += sizeof number;
        }
    }
    return at == end;
}

static int fail(RemoraStatus status) {
    fprintf(stderr, "%s\n", remora_strerror(status));
    return 1;
}

int main(int count, char **arguments) {
    void *workspace = REMORA_ALIGN(memory);
    RemoraMission mission;
    RemoraScenario scenario;
    RemoraOptions options;
    RemoraReport report;
    uint32_t mode, integrator;
    RemoraStatus status = remora_defaults(REMORA_ABI, NULL, NULL, &options, NULL);
    if (status != REMORA_STATUS_OK) {
        return fail(status);
    }
    if (!fill(&mission, sizeof mission) || !fill(&scenario, sizeof scenario) ||
        scanf("%" SCNu32 "%" SCNu32 "%" SCNu32, &mode, &integrator, &options.substeps) != 3) {
        fprintf(stderr, "the input is cut short\n");
        return 2;
    }
    options.mode = (RemoraMode)mode;
    options.integrator = (RemoraIntegrator)integrator;
    if (count > 1) {
        FILE *file = fopen(arguments[1], "rb");
        if (file == NULL) {
            perror(arguments[1]);
            return 2;
        }
        options.model_bytes = fread(model, 1, sizeof model, file);
        options.model = model;
        fclose(file);
    }
    report.size = sizeof report;
    status = remora_open(workspace, REMORA_WORKSPACE_BYTES, REMORA_ABI, &mission);
    if (status == REMORA_STATUS_OK) {
        status = remora_plan(workspace, &scenario, &options, &report);
    }
    if (status != REMORA_STATUS_OK) {
        return fail(status);
    }
    printf("%016" PRIx64 "\n", report.checksum);
    return 0;
}
