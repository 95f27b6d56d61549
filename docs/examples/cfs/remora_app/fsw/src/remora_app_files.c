/* Files of the planner's task: it reads the learned model and writes the plan. */
#include "remora_app.h"

#include <string.h>

static uint8                     REMORA_APP_Model[REMORA_APP_MODEL_BYTES];
static size_t                    REMORA_APP_ModelBytes;
static REMORA_APP_OptionsTable_t REMORA_APP_Read; /* the table that the model was read for */

/* Reads a file to its end; its length, or 0 where it cannot be read or is too long. */
static size_t REMORA_APP_ReadFile(const char *Name, uint8 *To, size_t Room)
{
    osal_id_t File;
    size_t    Length = 0;
    int32     Bytes;

    if (OS_OpenCreate(&File, Name, OS_FILE_FLAG_NONE, OS_READ_ONLY) != OS_SUCCESS)
    {
        return 0;
    }
    do
    {
        Bytes = OS_read(File, To + Length, Room - Length);
        Length += Bytes > 0 ? (size_t)Bytes : 0;
    } while (Bytes > 0 && Length < Room);
    OS_close(File);
    return Bytes < 0 || Length == Room ? 0 : Length;
}

/* Reads the table's model; says where there is none. */
static void REMORA_APP_ReadModel(const REMORA_APP_OptionsTable_t *Table)
{
    uint32 Crc;

    REMORA_APP_ModelBytes = REMORA_APP_ReadFile(Table->ModelFile, REMORA_APP_Model, sizeof(REMORA_APP_Model));
    if (REMORA_APP_ModelBytes == 0)
    {
        CFE_EVS_SendEvent(REMORA_APP_MODEL_ERR_EID, CFE_EVS_EventType_ERROR, "REMORA_APP: cannot read model %s",
                          Table->ModelFile);
        return;
    }
    Crc = CFE_ES_CalculateCRC(REMORA_APP_Model, REMORA_APP_ModelBytes, 0, CFE_MISSION_ES_DEFAULT_CRC);
    if (Crc != Table->ModelCrc)
    {
        REMORA_APP_ModelBytes = 0;
        CFE_EVS_SendEvent(REMORA_APP_MODEL_ERR_EID, CFE_EVS_EventType_ERROR,
                          "REMORA_APP: model has CRC 0x%04lx, the table says 0x%04lx", (unsigned long)Crc,
                          (unsigned long)Table->ModelCrc);
    }
}

void REMORA_APP_UseModel(const REMORA_APP_OptionsTable_t *Table, RemoraOptions *Options)
{
    if (Table->ModelFile[0] == '\0')
    {
        return;
    }
    /* Read once, and again where it could not be. */
    if (REMORA_APP_ModelBytes == 0 || Table->ModelCrc != REMORA_APP_Read.ModelCrc ||
        strcmp(Table->ModelFile, REMORA_APP_Read.ModelFile) != 0)
    {
        REMORA_APP_ReadModel(Table);
        REMORA_APP_Read = *Table;
    }
    if (REMORA_APP_ModelBytes > 0)
    {
        Options->model       = REMORA_APP_Model;
        Options->model_bytes = REMORA_APP_ModelBytes;
    }
}

static bool REMORA_APP_Write(osal_id_t File, const void *What, size_t Bytes)
{
    return OS_write(File, What, Bytes) == (int32)Bytes;
}

/* Writes cFE's header, report, record, residuals and nodes, one after the other as they lie in memory. */
static bool REMORA_APP_WriteAll(osal_id_t File, const RemoraReport *Report)
{
    const void        *Workspace = REMORA_APP_Workspace();
    CFE_FS_Header_t    Header;
    RemoraRecord       Record;
    RemoraVerification Verification;
    RemoraNode         Node;
    uint32             i;

    CFE_FS_InitHeader(&Header, "Remora plan", REMORA_ABI);
    Record.size       = sizeof(Record);
    Verification.size = sizeof(Verification);
    Node.size         = sizeof(Node);
    if (CFE_FS_WriteHeader(File, &Header) != (CFE_Status_t)sizeof(Header) ||
        remora_record(Workspace, &Record) != REMORA_STATUS_OK ||
        remora_verify(Workspace, &Verification) != REMORA_STATUS_OK ||
        !REMORA_APP_Write(File, Report, sizeof(*Report)) || !REMORA_APP_Write(File, &Record, sizeof(Record)) ||
        !REMORA_APP_Write(File, &Verification, sizeof(Verification)))
    {
        return false;
    }
    for (i = 0; i < Report->nodes; i++)
    {
        if (remora_node(Workspace, i, &Node) != REMORA_STATUS_OK || !REMORA_APP_Write(File, &Node, sizeof(Node)))
        {
            return false;
        }
    }
    return true;
}

void REMORA_APP_WritePlan(const RemoraReport *Report)
{
    osal_id_t File;
    bool      IsWhole = false;

    if (OS_OpenCreate(&File, REMORA_APP_UNFINISHED_FILE, OS_FILE_FLAG_CREATE | OS_FILE_FLAG_TRUNCATE,
                      OS_WRITE_ONLY) == OS_SUCCESS)
    {
        IsWhole = REMORA_APP_WriteAll(File, Report);
        IsWhole = OS_close(File) == OS_SUCCESS && IsWhole;
        IsWhole = IsWhole && OS_rename(REMORA_APP_UNFINISHED_FILE, REMORA_APP_PLAN_FILE) == OS_SUCCESS;
    }
    if (!IsWhole)
    {
        OS_remove(REMORA_APP_UNFINISHED_FILE);
        CFE_EVS_SendEvent(REMORA_APP_FILE_ERR_EID, CFE_EVS_EventType_ERROR, "REMORA_APP: cannot write the plan's file");
    }
}
