/* The planner's task, and how the main task hands it a job. Whoever REMORA_APP_Data.State names has workspace and
 * job; the mutex orders what both do with them. */
#include "remora_app.h"

static uint8 REMORA_APP_WorkspaceMemory[REMORA_WORKSPACE_BYTES + REMORA_ALIGNMENT - 1];

void *REMORA_APP_Workspace(void)
{
    return REMORA_ALIGN(REMORA_APP_WorkspaceMemory);
}

uint8 REMORA_APP_GetState(void)
{
    uint8 State;

    OS_MutSemTake(REMORA_APP_Data.Mutex);
    State = REMORA_APP_Data.State;
    OS_MutSemGive(REMORA_APP_Data.Mutex);
    return State;
}

void REMORA_APP_SetState(uint8 State)
{
    OS_MutSemTake(REMORA_APP_Data.Mutex);
    REMORA_APP_Data.State = State;
    OS_MutSemGive(REMORA_APP_Data.Mutex);
}

/* Time since the processor's start [s]. */
static double REMORA_APP_Clock(void *Context)
{
    OS_time_t Time;

    (void)Context;
    CFE_PSP_GetTime(&Time);
    return 1.0e-6 * (double)OS_TimeGetTotalMicroseconds(Time);
}

/* How to plan, by the table. */
static void REMORA_APP_GetOptions(const REMORA_APP_OptionsTable_t *Table, RemoraOptions *Options)
{
    remora_defaults(REMORA_ABI, NULL, NULL, Options, NULL);
    Options->mode       = (RemoraMode)Table->Mode;
    Options->integrator = (RemoraIntegrator)Table->Integrator;
    Options->substeps   = Table->Substeps;
    Options->clock      = REMORA_APP_Clock;
    if (Table->Deadline > 0.0)
    {
        Options->deadline_s = Table->Deadline;
    }
    REMORA_APP_UseModel(Table, Options);
}

static void REMORA_APP_Work(REMORA_APP_Job_t *Job)
{
    void         *Workspace = REMORA_APP_Workspace();
    RemoraOptions Options;

    Job->Report.size = sizeof(Job->Report);
    if (Job->Code == REMORA_APP_SELF_TEST_CC)
    {
        Job->Status = remora_self_test(Workspace, REMORA_INTEGRATOR_RK4, &Job->Checksum);
        return;
    }
    REMORA_APP_GetOptions(&Job->Options, &Options);
    if (Job->Code == REMORA_APP_PLAN_CC)
    {
        Job->Status = remora_plan(Workspace, &Job->Scenario, &Options, &Job->Report);
    }
    else
    {
        Job->Status =
            remora_replan(Workspace, REMORA_APP_FlightCopy(), &Job->Estimate, Job->Lead, &Options, &Job->Report);
    }
    if (Job->Status == REMORA_STATUS_OK)
    {
        REMORA_APP_WritePlan(&Job->Report);
    }
}

static void REMORA_APP_PlannerMain(void)
{
    while (OS_BinSemTake(REMORA_APP_Data.Semaphore) == OS_SUCCESS)
    {
        CFE_ES_PerfLogEntry(REMORA_APP_PLANNER_PERF_ID);
        REMORA_APP_Work(&REMORA_APP_Data.Job);
        CFE_ES_PerfLogExit(REMORA_APP_PLANNER_PERF_ID);
        REMORA_APP_SetState(REMORA_APP_DONE);
    }
    CFE_ES_ExitChildTask();
}

CFE_Status_t REMORA_APP_StartPlanner(void)
{
    CFE_ES_TaskId_t Task;

    if (OS_MutSemCreate(&REMORA_APP_Data.Mutex, "REMORA_MUT", 0) != OS_SUCCESS ||
        OS_BinSemCreate(&REMORA_APP_Data.Semaphore, "REMORA_SEM", OS_SEM_EMPTY, 0) != OS_SUCCESS)
    {
        return CFE_STATUS_EXTERNAL_RESOURCE_FAIL;
    }
    return CFE_ES_CreateChildTask(&Task, "REMORA_PLAN", REMORA_APP_PlannerMain, CFE_ES_TASK_STACK_ALLOCATE,
                                  REMORA_APP_PLANNER_STACK, REMORA_APP_PLANNER_PRIORITY, 0);
}

void REMORA_APP_StartJob(uint16 Code)
{
    REMORA_APP_Data.Job.Code    = Code;
    REMORA_APP_Data.Job.Options = REMORA_APP_Data.Options;
    if (Code == REMORA_APP_REPLAN_CC)
    {
        /* Guidance goes on in the flight itself meanwhile. */
        REMORA_APP_CopyFlight();
    }
    REMORA_APP_SetState(REMORA_APP_PLANNING);
    OS_BinSemGive(REMORA_APP_Data.Semaphore);
}

/* Counts a plan. */
static void REMORA_APP_Count(const RemoraReport *Report)
{
    REMORA_APP_HkTlm_Payload_t *Hk = &REMORA_APP_Data.Hk.Payload;

    REMORA_APP_Data.SumSeconds += Report->planning_time_s;
    Hk->Plans++;
    Hk->LastSeconds = Report->planning_time_s;
    Hk->MeanSeconds = REMORA_APP_Data.SumSeconds / Hk->Plans;
    if (Report->planning_time_s > Hk->LongestSeconds)
    {
        Hk->LongestSeconds = Report->planning_time_s;
    }
    Hk->Verdict  = Report->verdict;
    Hk->Checksum = Report->checksum;
}

/* What became of a plan; the state that follows. */
static uint8 REMORA_APP_CollectPlan(const REMORA_APP_Job_t *Job)
{
    const RemoraReport *Report = &Job->Report;

    REMORA_APP_Data.Hk.Payload.PlanStatus = Job->Status;
    REMORA_APP_Data.IsFlyable             = Job->Status == REMORA_STATUS_OK && Report->is_verified != 0;
    if (Job->Status != REMORA_STATUS_OK)
    {
        CFE_EVS_SendEvent(REMORA_APP_PLAN_ERR_EID, CFE_EVS_EventType_ERROR, "REMORA_APP: no plan: %s",
                          Job->Status == REMORA_STATUS_REFUSED ? Report->refusal_name : remora_strerror(Job->Status));
        return REMORA_APP_IDLE;
    }
    REMORA_APP_Count(Report);
    CFE_EVS_SendEvent(REMORA_APP_PLAN_INF_EID, CFE_EVS_EventType_INFORMATION,
                      "REMORA_APP: plan %08lx%08lx, verdict %lu, start %lu, %lu ms",
                      (unsigned long)(Report->checksum >> 32), (unsigned long)(Report->checksum & 0xffffffff),
                      (unsigned long)Report->verdict, (unsigned long)Report->start,
                      (unsigned long)(1000.0 * Report->planning_time_s));
    if (Job->Code == REMORA_APP_REPLAN_CC && REMORA_APP_Data.IsFlyable)
    {
        REMORA_APP_Data.Begins = Report->begins_s;
        return REMORA_APP_WAITING;
    }
    return REMORA_APP_IDLE;
}

static void REMORA_APP_CollectSelfTest(const REMORA_APP_Job_t *Job)
{
    REMORA_APP_Data.IsFlyable                   = false;
    REMORA_APP_Data.Hk.Payload.SelfTestChecksum = Job->Checksum;
    if (Job->Status == REMORA_STATUS_OK)
    {
        CFE_EVS_SendEvent(REMORA_APP_SELF_TEST_INF_EID, CFE_EVS_EventType_INFORMATION, "REMORA_APP: self-test passed");
    }
    else
    {
        CFE_EVS_SendEvent(REMORA_APP_SELF_TEST_ERR_EID, CFE_EVS_EventType_CRITICAL, "REMORA_APP: self-test: %s",
                          remora_strerror(Job->Status));
    }
}

void REMORA_APP_CollectJob(void)
{
    const REMORA_APP_Job_t *Job  = &REMORA_APP_Data.Job;
    uint8                   Next = REMORA_APP_IDLE;

    if (REMORA_APP_GetState() != REMORA_APP_DONE)
    {
        return;
    }
    if (Job->Code == REMORA_APP_SELF_TEST_CC)
    {
        REMORA_APP_CollectSelfTest(Job);
    }
    else
    {
        Next = REMORA_APP_CollectPlan(Job);
    }
    REMORA_APP_SetState(Next);
}
