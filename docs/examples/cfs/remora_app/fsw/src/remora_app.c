/* The app's main task: start-up, and where messages go. It guides; a task of its own plans. */
#include "remora_app.h"

#include <string.h>

REMORA_APP_Data_t REMORA_APP_Data;

/* Whether a step of start-up failed; says so. */
static bool REMORA_APP_InitFailed(const char *What, CFE_Status_t Status)
{
    if (Status != CFE_SUCCESS)
    {
        CFE_ES_WriteToSysLog("REMORA_APP: %s: 0x%08lx\n", What, (unsigned long)Status);
    }
    return Status != CFE_SUCCESS;
}

static CFE_Status_t REMORA_APP_Subscribe(CFE_SB_MsgId_Atom_t MsgId)
{
    return CFE_SB_Subscribe(CFE_SB_ValueToMsgId(MsgId), REMORA_APP_Data.Pipe);
}

static bool REMORA_APP_Init(void)
{
    REMORA_APP_Data_t *Data = &REMORA_APP_Data;

    memset(Data, 0, sizeof(*Data));
    Data->RunStatus = CFE_ES_RunStatus_APP_RUN;
    if (REMORA_APP_InitFailed("events", CFE_EVS_Register(NULL, 0, CFE_EVS_EventFilter_BINARY)) ||
        REMORA_APP_InitFailed("pipe", CFE_SB_CreatePipe(&Data->Pipe, REMORA_APP_PIPE_DEPTH, "REMORA_APP_PIPE")) ||
        REMORA_APP_InitFailed("commands", REMORA_APP_Subscribe(REMORA_APP_CMD_MID)) ||
        REMORA_APP_InitFailed("housekeeping", REMORA_APP_Subscribe(REMORA_APP_SEND_HK_MID)) ||
        REMORA_APP_InitFailed("wake-up", REMORA_APP_Subscribe(REMORA_APP_WAKEUP_MID)) ||
        REMORA_APP_InitFailed("estimates", REMORA_APP_Subscribe(REMORA_APP_ESTIMATE_MID)) ||
        REMORA_APP_InitFailed("tables", REMORA_APP_RegisterTables()) ||
        REMORA_APP_InitFailed("planner", REMORA_APP_StartPlanner()))
    {
        return false;
    }
    CFE_MSG_Init(CFE_MSG_PTR(Data->Hk.TelemetryHeader), CFE_SB_ValueToMsgId(REMORA_APP_HK_TLM_MID), sizeof(Data->Hk));
    CFE_MSG_Init(CFE_MSG_PTR(Data->Command.TelemetryHeader), CFE_SB_ValueToMsgId(REMORA_APP_COMMAND_MID),
                 sizeof(Data->Command));
    REMORA_APP_ReadTables();
    CFE_EVS_SendEvent(REMORA_APP_STARTUP_INF_EID, CFE_EVS_EventType_INFORMATION, "REMORA_APP: interface %lu",
                      (unsigned long)remora_abi());
    return true;
}

/* Whether a message has the size of its structure; says so where not. */
static bool REMORA_APP_HasSize(const CFE_SB_Buffer_t *Buffer, size_t Expected)
{
    size_t Size = 0;

    CFE_MSG_GetSize(&Buffer->Msg, &Size);
    if (Size != Expected)
    {
        REMORA_APP_Data.Hk.Payload.CommandErrorCounter++;
        CFE_EVS_SendEvent(REMORA_APP_LEN_ERR_EID, CFE_EVS_EventType_ERROR, "REMORA_APP: message of %lu bytes, not %lu",
                          (unsigned long)Size, (unsigned long)Expected);
    }
    return Size == Expected;
}

static void REMORA_APP_ProcessMessage(const CFE_SB_Buffer_t *Buffer)
{
    CFE_SB_MsgId_t MsgId = CFE_SB_INVALID_MSG_ID;

    REMORA_APP_CollectJob();
    CFE_MSG_GetMsgId(&Buffer->Msg, &MsgId);
    switch (CFE_SB_MsgIdToValue(MsgId))
    {
        case REMORA_APP_CMD_MID:
            REMORA_APP_ProcessGroundCommand(Buffer);
            break;

        case REMORA_APP_SEND_HK_MID:
            if (REMORA_APP_HasSize(Buffer, sizeof(REMORA_APP_NoArgsCmd_t)))
            {
                REMORA_APP_ReadTables();
                REMORA_APP_SendHk();
            }
            break;

        case REMORA_APP_WAKEUP_MID:
            if (REMORA_APP_HasSize(Buffer, sizeof(REMORA_APP_NoArgsCmd_t)))
            {
                REMORA_APP_Wakeup();
            }
            break;

        case REMORA_APP_ESTIMATE_MID:
            if (REMORA_APP_HasSize(Buffer, sizeof(REMORA_APP_EstimateMsg_t)))
            {
                REMORA_APP_TakeEstimate(&((const REMORA_APP_EstimateMsg_t *)Buffer)->Estimate);
            }
            break;

        default:
            CFE_EVS_SendEvent(REMORA_APP_MID_ERR_EID, CFE_EVS_EventType_ERROR, "REMORA_APP: not for it: message 0x%lx",
                              (unsigned long)CFE_SB_MsgIdToValue(MsgId));
            break;
    }
}

void REMORA_APP_Main(void)
{
    CFE_SB_Buffer_t *Buffer;

    CFE_ES_PerfLogEntry(REMORA_APP_PERF_ID);
    if (!REMORA_APP_Init())
    {
        REMORA_APP_Data.RunStatus = CFE_ES_RunStatus_APP_ERROR;
    }
    while (CFE_ES_RunLoop(&REMORA_APP_Data.RunStatus))
    {
        CFE_ES_PerfLogExit(REMORA_APP_PERF_ID);
        if (CFE_SB_ReceiveBuffer(&Buffer, REMORA_APP_Data.Pipe, CFE_SB_PEND_FOREVER) == CFE_SUCCESS)
        {
            CFE_ES_PerfLogEntry(REMORA_APP_PERF_ID);
            REMORA_APP_ProcessMessage(Buffer);
        }
        else
        {
            CFE_ES_PerfLogEntry(REMORA_APP_PERF_ID);
            CFE_EVS_SendEvent(REMORA_APP_PIPE_ERR_EID, CFE_EVS_EventType_ERROR, "REMORA_APP: its pipe cannot be read");
            REMORA_APP_Data.RunStatus = CFE_ES_RunStatus_APP_ERROR;
        }
    }
    CFE_ES_PerfLogExit(REMORA_APP_PERF_ID);
    CFE_ES_ExitApp(REMORA_APP_Data.RunStatus);
}
