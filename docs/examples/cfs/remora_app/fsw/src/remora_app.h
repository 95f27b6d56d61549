/* What the files of the app share. */
#ifndef REMORA_APP_H
#define REMORA_APP_H

#include "cfe.h"
#include "remora_app_cfg.h"
#include "remora_app_eventids.h"
#include "remora_app_msg.h"
#include "remora_app_msgids.h"
#include "remora_app_perfids.h"
#include "remora_app_tbl.h"

/* What the planner's task is asked for, and what comes of it. */
typedef struct {
    uint16 Code; /* REMORA_APP_PLAN_CC, _REPLAN_CC or _SELF_TEST_CC */
    RemoraScenario Scenario;
    RemoraEstimate Estimate; /* REPLAN, like the next */
    double Lead;
    REMORA_APP_OptionsTable_t Options;
    RemoraStatus Status;
    RemoraReport Report;
    uint64 Checksum; /* SELF_TEST */
} REMORA_APP_Job_t;

typedef struct {
    uint32 RunStatus;
    CFE_SB_PipeId_t Pipe;
    CFE_TBL_Handle_t MissionTable;
    CFE_TBL_Handle_t OptionsTable;
    REMORA_APP_HkTlm_t Hk;
    REMORA_APP_CommandMsg_t Command;

    /* Under the mutex: who has the workspace and the job. */
    osal_id_t Mutex;
    uint8 State;

    osal_id_t Semaphore; /* given when there is a job */
    REMORA_APP_Job_t Job;

    /* The main task's. */
    REMORA_APP_OptionsTable_t Options;
    RemoraEstimate Estimate;
    bool IsFresh;    /* whether the estimate is newer than the last step */
    bool IsFlying;
    bool IsFlyable;  /* whether the workspace holds a verified plan */
    double Begins;   /* when the plan that waits is to be flown [s] */
    double SumSeconds;
    uint32 Wanted;   /* why guidance wants another plan; 0: it does not */
} REMORA_APP_Data_t;

extern REMORA_APP_Data_t REMORA_APP_Data;

void REMORA_APP_Main(void);

/* remora_app_cmds.c */
void REMORA_APP_ProcessGroundCommand(const CFE_SB_Buffer_t *Buffer);
void REMORA_APP_SendHk(void);

/* remora_app_planner.c: the planner's task, and the main task's side of it */
CFE_Status_t REMORA_APP_StartPlanner(void);
void *REMORA_APP_Workspace(void);
uint8 REMORA_APP_GetState(void);
void REMORA_APP_SetState(uint8 State);
void REMORA_APP_StartJob(uint16 Code);
void REMORA_APP_CollectJob(void);

/* remora_app_files.c: what the planner's task reads and writes */
void REMORA_APP_UseModel(const REMORA_APP_OptionsTable_t *Table, RemoraOptions *Options);
void REMORA_APP_WritePlan(const RemoraReport *Report);

/* remora_app_tables.c */
CFE_Status_t REMORA_APP_RegisterTables(void);
void REMORA_APP_ReadTables(void);

/* remora_app_guidance.c */
RemoraStatus REMORA_APP_MakeFlight(void);
void REMORA_APP_CopyFlight(void);
const void *REMORA_APP_FlightCopy(void);
void REMORA_APP_TakeEstimate(const RemoraEstimate *Estimate);
void REMORA_APP_Wakeup(void);
void REMORA_APP_Abort(void);

#endif
