/* Guidance, in the main task: a step with each wake-up that follows a new estimate. */
#include "remora_app.h"

#include <string.h>

static uint8 REMORA_APP_FlightMemory[REMORA_FLIGHT_BYTES + REMORA_ALIGNMENT - 1];
static uint8 REMORA_APP_CopyMemory[REMORA_FLIGHT_BYTES + REMORA_ALIGNMENT - 1];

static void *REMORA_APP_Flight(void)
{
    return REMORA_ALIGN(REMORA_APP_FlightMemory);
}

RemoraStatus REMORA_APP_MakeFlight(void)
{
    return remora_fly(REMORA_APP_Flight(), REMORA_FLIGHT_BYTES, REMORA_ABI, &REMORA_APP_Data.Options.Guidance);
}

const void *REMORA_APP_FlightCopy(void)
{
    return REMORA_ALIGN(REMORA_APP_CopyMemory);
}

void REMORA_APP_CopyFlight(void)
{
    memcpy(REMORA_ALIGN(REMORA_APP_CopyMemory), REMORA_APP_Flight(), REMORA_FLIGHT_BYTES);
}

void REMORA_APP_TakeEstimate(const RemoraEstimate *Estimate)
{
    REMORA_APP_Data.Estimate = *Estimate;
    REMORA_APP_Data.IsFresh  = true;
}

/* Keeps what became of a call; whether it failed. */
static bool REMORA_APP_GuidanceFailed(uint16 EventId, RemoraStatus Status)
{
    /* One event for each new reason: the steps are many. */
    if (Status != REMORA_STATUS_OK && Status != REMORA_APP_Data.Hk.Payload.GuideStatus)
    {
        CFE_EVS_SendEvent(EventId, CFE_EVS_EventType_ERROR, "REMORA_APP: guidance: %s", remora_strerror(Status));
    }
    REMORA_APP_Data.Hk.Payload.GuideStatus = Status;
    return Status != REMORA_STATUS_OK;
}

/* Hands the plan that waits to the flight once its time has come. */
static void REMORA_APP_TakeOver(void)
{
    RemoraStatus Status;

    if (REMORA_APP_GetState() != REMORA_APP_WAITING || REMORA_APP_Data.Estimate.time_s < REMORA_APP_Data.Begins)
    {
        return;
    }
    Status = remora_flight_plan(REMORA_APP_Workspace(), REMORA_APP_Data.Begins, REMORA_APP_Flight());
    if (!REMORA_APP_GuidanceFailed(REMORA_APP_FLY_ERR_EID, Status))
    {
        REMORA_APP_Data.IsFlying = true;
        CFE_EVS_SendEvent(REMORA_APP_FLY_INF_EID, CFE_EVS_EventType_INFORMATION, "REMORA_APP: flies the new plan");
    }
    REMORA_APP_SetState(REMORA_APP_IDLE);
}

/* Sends the actuators their command, and tells the ground what guidance wants. */
static void REMORA_APP_SendCommand(const RemoraCommand *Command)
{
    REMORA_APP_HkTlm_Payload_t *Hk = &REMORA_APP_Data.Hk.Payload;

    CFE_SB_TimeStampMsg(CFE_MSG_PTR(REMORA_APP_Data.Command.TelemetryHeader));
    CFE_SB_TransmitMsg(CFE_MSG_PTR(REMORA_APP_Data.Command.TelemetryHeader), true);
    if (Command->wanted != REMORA_REASON_NONE && REMORA_APP_Data.Wanted == REMORA_REASON_NONE)
    {
        CFE_EVS_SendEvent(REMORA_APP_REPLAN_WANTED_INF_EID, CFE_EVS_EventType_INFORMATION,
                          "REMORA_APP: another plan is wanted, reason %lu", (unsigned long)Command->wanted);
    }
    if (Command->mode == REMORA_FLIGHT_MODE_ABORT && Hk->Mode != REMORA_FLIGHT_MODE_ABORT)
    {
        CFE_EVS_SendEvent(REMORA_APP_LEAVING_INF_EID, CFE_EVS_EventType_CRITICAL, "REMORA_APP: leaves the target");
    }
    REMORA_APP_Data.Wanted = Command->wanted;
    Hk->Mode               = Command->mode;
    Hk->TrackingError[0]   = Command->com_error_m;
    Hk->TrackingError[1]   = Command->bus_error_rad;
    Hk->TrackingError[2]   = Command->joint_error_rad;
    Hk->Steps++;
}

void REMORA_APP_Wakeup(void)
{
    RemoraCommand *Command = &REMORA_APP_Data.Command.Command;

    if (!REMORA_APP_Data.IsFresh)
    {
        if (REMORA_APP_Data.IsFlying && REMORA_APP_Data.Hk.Payload.Missed++ == 0)
        {
            CFE_EVS_SendEvent(REMORA_APP_MISSED_ERR_EID, CFE_EVS_EventType_ERROR,
                              "REMORA_APP: woken up without a new estimate");
        }
        return;
    }
    REMORA_APP_Data.IsFresh = false;
    REMORA_APP_TakeOver();
    if (!REMORA_APP_Data.IsFlying)
    {
        return;
    }
    Command->size = sizeof(*Command);
    if (!REMORA_APP_GuidanceFailed(REMORA_APP_GUIDE_ERR_EID,
                                   remora_guide(REMORA_APP_Flight(), &REMORA_APP_Data.Estimate, NULL, Command)))
    {
        REMORA_APP_SendCommand(Command);
    }
}

void REMORA_APP_Abort(void)
{
    if (REMORA_APP_GetState() == REMORA_APP_WAITING)
    {
        REMORA_APP_SetState(REMORA_APP_IDLE);
    }
    (void)REMORA_APP_GuidanceFailed(REMORA_APP_GUIDE_ERR_EID, remora_ask(REMORA_APP_Flight(), REMORA_REQUEST_ABORT));
}
