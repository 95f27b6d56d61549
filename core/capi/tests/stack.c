/* Plans, plans again and guides on stacks of its own that were painted before; prints what each used [bytes]. */
#define _POSIX_C_SOURCE 200809L
#include <pthread.h>
#include <remora.h>
#include <stdio.h>
#include <string.h>

enum { STACK = 1 << 20, ALIGN = 4096 };
static unsigned char workspace_memory[REMORA_WORKSPACE_BYTES + REMORA_ALIGNMENT - 1];
static unsigned char flight_memory[REMORA_FLIGHT_BYTES + REMORA_ALIGNMENT - 1];
static unsigned char stack_memory[STACK + ALIGN];
static RemoraScenario scenario;
static RemoraOptions options;
static RemoraReport report;
static RemoraEstimate estimate;
static RemoraCommand command;
static RemoraStatus status;

static void *nothing(void *unused) { return unused; }

static void *plan(void *workspace) {
    status = remora_plan(workspace, &scenario, &options, &report);
    return NULL;
}

static void *replan(void *workspace) {
    status = remora_replan(workspace, REMORA_ALIGN(flight_memory), &estimate, 20.0, &options, &report);
    return NULL;
}

static void *guide(void *flight) {
    status = remora_guide(flight, &estimate, NULL, &command);
    return NULL;
}

/* What a thread used of its stack. */
static long used(void *(*work)(void *), void *argument) {
    unsigned char *stack = stack_memory + (ALIGN - (size_t)stack_memory % ALIGN);
    pthread_attr_t attributes;
    pthread_t thread;
    long i = 0;
    memset(stack, 0xa5, STACK);
    status = REMORA_STATUS_OK;
    pthread_attr_init(&attributes);
    if (pthread_attr_setstack(&attributes, stack, STACK) != 0 ||
        pthread_create(&thread, &attributes, work, argument) != 0) {
        return -1;
    }
    pthread_join(thread, NULL);
    while (i < STACK && stack[i] == 0xa5) {
        i++;
    }
    return status == REMORA_STATUS_OK ? STACK - i : -1;
}

int main(void) {
    void *workspace = REMORA_ALIGN(workspace_memory), *flight = REMORA_ALIGN(flight_memory);
    RemoraMission mission;
    long before;
    remora_defaults(REMORA_ABI, &mission, &scenario, &options, NULL);
    remora_open(workspace, REMORA_WORKSPACE_BYTES, REMORA_ABI, &mission);
    remora_fly(flight, REMORA_FLIGHT_BYTES, REMORA_ABI, NULL);
    report.size = sizeof report;
    estimate.size = sizeof estimate;
    command.size = sizeof command;
    before = used(nothing, NULL);
    printf("plan %ld\n", used(plan, workspace) - before);
    if (remora_flight_plan(workspace, 0.0, flight) != REMORA_STATUS_OK ||
        remora_expected(flight, 300.0, &estimate) != REMORA_STATUS_OK) {
        return 1;
    }
    printf("replan %ld\n", used(replan, workspace) - before);
    printf("guide %ld\n", used(guide, flight) - before);
    return 0;
}
