/* Commands from the ground, and housekeeping. */
#include "remora_app.h"

/* The size that a command must have; 0 for a code that is none. */
static size_t REMORA_APP_SizeOf(CFE_MSG_FcnCode_t Code)
{
    switch (Code)
    {
        case REMORA_APP_NOOP_CC:
        case REMORA_APP_RESET_COUNTERS_CC:
        case REMORA_APP_SELF_TEST_CC:
        case REMORA_APP_ABORT_CC:
            return sizeof(REMORA_APP_NoArgsCmd_t);

        case REMORA_APP_PLAN_CC:
            return sizeof(REMORA_APP_PlanCmd_t);

        case REMORA_APP_FLY_CC:
        case REMORA_APP_REPLAN_CC:
            return sizeof(REMORA_APP_TimeCmd_t);

        default:
            return 0;
    }
}

/* Whether the command is one, and as long as it must be. */
static bool REMORA_APP_IsCommand(const CFE_SB_Buffer_t *Buffer, CFE_MSG_FcnCode_t Code)
{
    size_t Expected = REMORA_APP_SizeOf(Code), Size = 0;

    CFE_MSG_GetSize(&Buffer->Msg, &Size);
    if (Expected == 0)
    {
        CFE_EVS_SendEvent(REMORA_APP_CC_ERR_EID, CFE_EVS_EventType_ERROR, "REMORA_APP: no command has code %u",
                          (unsigned int)Code);
    }
    else if (Size != Expected)
    {
        CFE_EVS_SendEvent(REMORA_APP_LEN_ERR_EID, CFE_EVS_EventType_ERROR,
                          "REMORA_APP: command %u of %lu bytes, not %lu", (unsigned int)Code, (unsigned long)Size,
                          (unsigned long)Expected);
    }
    return Size == Expected;
}

/* Whether the main task has the workspace and no plan waits in it; says so where not. */
static bool REMORA_APP_IsIdle(void)
{
    if (REMORA_APP_GetState() != REMORA_APP_IDLE)
    {
        CFE_EVS_SendEvent(REMORA_APP_BUSY_ERR_EID, CFE_EVS_EventType_ERROR,
                          "REMORA_APP: busy: plans, or a plan waits for its time");
        return false;
    }
    return true;
}

/* Has the plan in the workspace flown from a time on. */
static bool REMORA_APP_Fly(double Begins)
{
    if (!REMORA_APP_Data.IsFlyable)
    {
        CFE_EVS_SendEvent(REMORA_APP_FLY_ERR_EID, CFE_EVS_EventType_ERROR, "REMORA_APP: no verified plan to be flown");
        return false;
    }
    REMORA_APP_Data.Begins = Begins;
    REMORA_APP_SetState(REMORA_APP_WAITING);
    return true;
}

static void REMORA_APP_Reset(void)
{
    REMORA_APP_HkTlm_Payload_t *Hk = &REMORA_APP_Data.Hk.Payload;

    Hk->CommandCounter      = 0;
    Hk->CommandErrorCounter = 0;
    Hk->Missed              = 0;
    CFE_EVS_SendEvent(REMORA_APP_RESET_INF_EID, CFE_EVS_EventType_INFORMATION, "REMORA_APP: counters are zero");
}

/* Does what a command asks for; whether it could be done or begun. */
static bool REMORA_APP_Obey(const CFE_SB_Buffer_t *Buffer, CFE_MSG_FcnCode_t Code)
{
    REMORA_APP_Job_t *Job = &REMORA_APP_Data.Job;

    switch (Code)
    {
        case REMORA_APP_NOOP_CC:
            CFE_EVS_SendEvent(REMORA_APP_NOOP_INF_EID, CFE_EVS_EventType_INFORMATION, "REMORA_APP: no operation");
            return true;

        case REMORA_APP_ABORT_CC:
            REMORA_APP_Abort();
            return true;

        default:
            break;
    }
    /* The others want the workspace. */
    if (!REMORA_APP_IsIdle())
    {
        return false;
    }
    switch (Code)
    {
        case REMORA_APP_PLAN_CC:
            Job->Scenario = ((const REMORA_APP_PlanCmd_t *)Buffer)->Scenario;
            break;

        case REMORA_APP_FLY_CC:
            return REMORA_APP_Fly(((const REMORA_APP_TimeCmd_t *)Buffer)->Time);

        case REMORA_APP_REPLAN_CC:
            Job->Estimate = REMORA_APP_Data.Estimate;
            Job->Lead     = ((const REMORA_APP_TimeCmd_t *)Buffer)->Time;
            break;

        default:
            break;
    }
    REMORA_APP_StartJob(Code);
    return true;
}

void REMORA_APP_ProcessGroundCommand(const CFE_SB_Buffer_t *Buffer)
{
    REMORA_APP_HkTlm_Payload_t *Hk   = &REMORA_APP_Data.Hk.Payload;
    CFE_MSG_FcnCode_t           Code = 0;

    CFE_MSG_GetFcnCode(&Buffer->Msg, &Code);
    if (!REMORA_APP_IsCommand(Buffer, Code))
    {
        Hk->CommandErrorCounter++;
    }
    else if (Code == REMORA_APP_RESET_COUNTERS_CC)
    {
        REMORA_APP_Reset();
    }
    else if (REMORA_APP_Obey(Buffer, Code))
    {
        Hk->CommandCounter++;
    }
    else
    {
        Hk->CommandErrorCounter++;
    }
}

void REMORA_APP_SendHk(void)
{
    REMORA_APP_HkTlm_t *Hk = &REMORA_APP_Data.Hk;

    Hk->Payload.State    = REMORA_APP_GetState();
    Hk->Payload.IsFlying = REMORA_APP_Data.IsFlying ? 1 : 0;
    CFE_SB_TimeStampMsg(CFE_MSG_PTR(Hk->TelemetryHeader));
    CFE_SB_TransmitMsg(CFE_MSG_PTR(Hk->TelemetryHeader), true);
}
