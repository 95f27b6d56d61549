/* Command codes, commands and telemetry. Structures of remora.h travel as they are; their first member is their
 * size. */
#ifndef REMORA_APP_MSG_H
#define REMORA_APP_MSG_H

#include "cfe.h"

#include <remora.h>

#define REMORA_APP_NOOP_CC 0
#define REMORA_APP_RESET_COUNTERS_CC 1
#define REMORA_APP_PLAN_CC 2      /* plans an approach; the plan goes out as a file */
#define REMORA_APP_SELF_TEST_CC 3 /* plans a built-in scenario and compares the checksum */
#define REMORA_APP_FLY_CC 4       /* guidance flies the plan from a time on */
#define REMORA_APP_REPLAN_CC 5    /* plans again what is left, to take over some seconds from now */
#define REMORA_APP_ABORT_CC 6     /* leaves the target; there is no way back */

/* Commands without arguments, the requests of the scheduler among them. */
typedef struct {
    CFE_MSG_CommandHeader_t CommandHeader;
} REMORA_APP_NoArgsCmd_t;

typedef struct {
    CFE_MSG_CommandHeader_t CommandHeader;
    RemoraScenario Scenario;
} REMORA_APP_PlanCmd_t;

/* FLY: when the plan begins, on the clock of the estimates. REPLAN: from the newest estimate to then [s]. */
typedef struct {
    CFE_MSG_CommandHeader_t CommandHeader;
    double Time;
} REMORA_APP_TimeCmd_t;

/* Navigation's. */
typedef struct {
    CFE_MSG_TelemetryHeader_t TelemetryHeader;
    RemoraEstimate Estimate;
} REMORA_APP_EstimateMsg_t;

/* To the actuators. */
typedef struct {
    CFE_MSG_TelemetryHeader_t TelemetryHeader;
    RemoraCommand Command;
} REMORA_APP_CommandMsg_t;

/* Who has the workspace. */
#define REMORA_APP_IDLE 0     /* the main task */
#define REMORA_APP_PLANNING 1 /* the planner's task */
#define REMORA_APP_DONE 2     /* the main task, which has not looked at the result yet */
#define REMORA_APP_WAITING 3  /* the main task: the plan waits for its time */

typedef struct {
    uint64 Checksum;         /* of the last plan: the same behind every door of Remora */
    uint64 SelfTestChecksum; /* of the last self-test; REMORA_SELF_TEST_RK4 is right */
    double LastSeconds;      /* of a plan */
    double MeanSeconds;
    double LongestSeconds;
    double TrackingError[3]; /* centre of mass [m], attitude, the joint farthest off [rad] */
    uint32 Plans;
    uint32 PlanStatus;  /* RemoraStatus of the last plan */
    uint32 Verdict;     /* RemoraVerdict of the last plan */
    uint32 GuideStatus; /* RemoraStatus of the last step of guidance, hand-over or abort */
    uint32 Mode;        /* RemoraFlightMode of the last step */
    uint32 Steps;       /* of guidance */
    uint32 Missed;      /* wake-ups without a new estimate */
    uint8 State;
    uint8 IsFlying;
    uint8 CommandCounter;
    uint8 CommandErrorCounter;
} REMORA_APP_HkTlm_Payload_t;

typedef struct {
    CFE_MSG_TelemetryHeader_t TelemetryHeader;
    REMORA_APP_HkTlm_Payload_t Payload;
} REMORA_APP_HkTlm_t;

#endif
