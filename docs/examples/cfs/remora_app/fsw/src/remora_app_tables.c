/* Tables: what is looked at before one is taken, and what follows from a new one. */
#include "remora_app.h"

#include <stddef.h>

/* Whether a table's first number is the checksum of what follows it; says so where not. */
static bool REMORA_APP_HasCrc(const char *Name, const void *Table, size_t Size)
{
    const uint32 *Expected = Table;
    uint32        Found;

    Found = CFE_ES_CalculateCRC(Expected + 1, Size - sizeof(uint32), 0, CFE_MISSION_ES_DEFAULT_CRC);
    if (Found != *Expected)
    {
        CFE_EVS_SendEvent(REMORA_APP_TABLE_ERR_EID, CFE_EVS_EventType_ERROR,
                          "REMORA_APP: table %s has CRC 0x%04lx, it says 0x%04lx", Name, (unsigned long)Found,
                          (unsigned long)*Expected);
    }
    return Found == *Expected;
}

static int32 REMORA_APP_ValidateMission(void *Table)
{
    return REMORA_APP_HasCrc("Mission", Table, sizeof(REMORA_APP_MissionTable_t)) ? CFE_SUCCESS : -1;
}

static int32 REMORA_APP_ValidateOptions(void *Table)
{
    const REMORA_APP_OptionsTable_t *Options = Table;

    if (!REMORA_APP_HasCrc("Options", Table, sizeof(REMORA_APP_OptionsTable_t)))
    {
        return -1;
    }
    /* The name must end; numbers the archive looks at. */
    return Options->ModelFile[sizeof(Options->ModelFile) - 1] == '\0' ? CFE_SUCCESS : -2;
}

static CFE_Status_t REMORA_APP_RegisterTable(CFE_TBL_Handle_t *Handle, const char *Name, size_t Size,
                                             CFE_TBL_CallbackFuncPtr_t Validate, const char *File)
{
    CFE_Status_t Status = CFE_TBL_Register(Handle, Name, Size, CFE_TBL_OPT_DEFAULT, Validate);

    if (Status == CFE_SUCCESS)
    {
        Status = CFE_TBL_Load(*Handle, CFE_TBL_SRC_FILE, File);
    }
    return Status;
}

CFE_Status_t REMORA_APP_RegisterTables(void)
{
    CFE_Status_t Status =
        REMORA_APP_RegisterTable(&REMORA_APP_Data.MissionTable, "Mission", sizeof(REMORA_APP_MissionTable_t),
                                 REMORA_APP_ValidateMission, REMORA_APP_MISSION_FILE);

    if (Status == CFE_SUCCESS)
    {
        Status = REMORA_APP_RegisterTable(&REMORA_APP_Data.OptionsTable, "Options", sizeof(REMORA_APP_OptionsTable_t),
                                          REMORA_APP_ValidateOptions, REMORA_APP_OPTIONS_FILE);
    }
    return Status;
}

/* Says where the archive does not take what a table holds. */
static void REMORA_APP_Use(const char *Name, RemoraStatus Status)
{
    if (Status != REMORA_STATUS_OK)
    {
        CFE_EVS_SendEvent(REMORA_APP_TABLE_ERR_EID, CFE_EVS_EventType_ERROR, "REMORA_APP: table %s: %s", Name,
                          remora_strerror(Status));
    }
}

/* A new mission: the workspace is opened for it. The flight keeps the mission of its plan. */
static void REMORA_APP_ReadMission(void)
{
    void        *Table;
    CFE_Status_t Status = CFE_TBL_GetAddress(&Table, REMORA_APP_Data.MissionTable);

    if (Status == CFE_TBL_INFO_UPDATED)
    {
        REMORA_APP_Data.IsFlyable = false;
        REMORA_APP_Use("Mission", remora_open(REMORA_APP_Workspace(), REMORA_WORKSPACE_BYTES, REMORA_ABI,
                                              &((const REMORA_APP_MissionTable_t *)Table)->Mission));
    }
    CFE_TBL_ReleaseAddress(REMORA_APP_Data.MissionTable);
}

/* New options: the next plan is made with them. A flight has its settings of guidance for as long as it lasts. */
static void REMORA_APP_ReadOptions(void)
{
    void        *Table;
    CFE_Status_t Status = CFE_TBL_GetAddress(&Table, REMORA_APP_Data.OptionsTable);

    if (Status == CFE_TBL_INFO_UPDATED)
    {
        REMORA_APP_Data.Options = *(const REMORA_APP_OptionsTable_t *)Table;
        if (!REMORA_APP_Data.IsFlying)
        {
            REMORA_APP_Use("Options", REMORA_APP_MakeFlight());
        }
    }
    CFE_TBL_ReleaseAddress(REMORA_APP_Data.OptionsTable);
}

void REMORA_APP_ReadTables(void)
{
    /* While the workspace is in use, tables wait. */
    if (REMORA_APP_GetState() == REMORA_APP_IDLE)
    {
        CFE_TBL_Manage(REMORA_APP_Data.MissionTable);
        CFE_TBL_Manage(REMORA_APP_Data.OptionsTable);
        REMORA_APP_ReadMission();
        REMORA_APP_ReadOptions();
    }
}
