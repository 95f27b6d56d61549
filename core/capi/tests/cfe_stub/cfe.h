/* A stub of the core Flight System: the calls of cFE, OSAL and PSP that docs/examples/cfs uses, with the signatures
 * of cFE 7. Not cFE's: the app is built against the real headers in its mission. */
#ifndef CFE_STUB_H
#define CFE_STUB_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef int8_t int8;
typedef int16_t int16;
typedef int32_t int32;
typedef int64_t int64;
typedef uint8_t uint8;
typedef uint16_t uint16;
typedef uint32_t uint32;
typedef uint64_t uint64;

/* Status codes: errors are negative. */
typedef int32 CFE_Status_t;
#define CFE_SUCCESS ((CFE_Status_t)0)
#define CFE_STATUS_EXTERNAL_RESOURCE_FAIL ((CFE_Status_t)0xc8000005)
#define CFE_TBL_INFO_UPDATED ((CFE_Status_t)0x4c00000e)

/* OSAL */
typedef struct { uint32 v; } osal_id_t;
typedef struct { int64 ticks; } OS_time_t;
#define OS_SUCCESS (0)
#define OS_ERROR (-1)
#define OS_SEM_EMPTY 0
#define OS_READ_ONLY 0
#define OS_WRITE_ONLY 1
enum { OS_FILE_FLAG_NONE = 0, OS_FILE_FLAG_CREATE = 1, OS_FILE_FLAG_TRUNCATE = 2 };
int32 OS_BinSemCreate(osal_id_t *sem_id, const char *sem_name, uint32 sem_initial_value, uint32 options);
int32 OS_BinSemGive(osal_id_t sem_id);
int32 OS_BinSemTake(osal_id_t sem_id);
int32 OS_MutSemCreate(osal_id_t *sem_id, const char *sem_name, uint32 options);
int32 OS_MutSemGive(osal_id_t sem_id);
int32 OS_MutSemTake(osal_id_t sem_id);
int32 OS_OpenCreate(osal_id_t *filedes, const char *path, int32 flags, int32 access_mode);
int32 OS_close(osal_id_t filedes);
int32 OS_read(osal_id_t filedes, void *buffer, size_t nbytes);
int32 OS_write(osal_id_t filedes, const void *buffer, size_t nbytes);
int32 OS_remove(const char *path);
int32 OS_rename(const char *old_filename, const char *new_filename);
int64 OS_TimeGetTotalMicroseconds(OS_time_t tm);

/* PSP */
void CFE_PSP_GetTime(OS_time_t *LocalTime);

/* Executive services */
typedef struct { uint32 id; } CFE_ES_TaskId_t;
typedef void (*CFE_ES_ChildTaskMainFuncPtr_t)(void);
typedef void *CFE_ES_StackPointer_t;
typedef uint16 CFE_ES_TaskPriority_Atom_t;
typedef enum { CFE_ES_CrcType_NONE, CFE_ES_CrcType_16_ARC } CFE_ES_CrcType_Enum_t;
enum { CFE_ES_RunStatus_APP_RUN = 1, CFE_ES_RunStatus_APP_EXIT, CFE_ES_RunStatus_APP_ERROR };
#define CFE_MISSION_ES_DEFAULT_CRC CFE_ES_CrcType_16_ARC
#define CFE_ES_TASK_STACK_ALLOCATE NULL
CFE_Status_t CFE_ES_WriteToSysLog(const char *SpecStringPtr, ...) __attribute__((format(printf, 1, 2)));
bool CFE_ES_RunLoop(uint32 *RunStatus);
void CFE_ES_ExitApp(uint32 ExitStatus);
CFE_Status_t CFE_ES_CreateChildTask(CFE_ES_TaskId_t *TaskIdPtr, const char *TaskName,
                                    CFE_ES_ChildTaskMainFuncPtr_t FunctionPtr, CFE_ES_StackPointer_t StackPtr,
                                    size_t StackSize, CFE_ES_TaskPriority_Atom_t Priority, uint32 Flags);
void CFE_ES_ExitChildTask(void);
uint32 CFE_ES_CalculateCRC(const void *DataPtr, size_t DataLength, uint32 InputCRC, CFE_ES_CrcType_Enum_t TypeCRC);
#define CFE_ES_PerfLogEntry(id) ((void)(id))
#define CFE_ES_PerfLogExit(id) ((void)(id))

/* Event services */
typedef uint16 CFE_EVS_EventType_Enum_t;
enum { CFE_EVS_EventType_INFORMATION = 2, CFE_EVS_EventType_ERROR, CFE_EVS_EventType_CRITICAL };
enum { CFE_EVS_EventFilter_BINARY };
CFE_Status_t CFE_EVS_Register(const void *Filters, uint16 NumEventFilters, uint16 FilterScheme);
CFE_Status_t CFE_EVS_SendEvent(uint16 EventID, CFE_EVS_EventType_Enum_t EventType, const char *Spec, ...)
    __attribute__((format(printf, 3, 4)));

/* Messages and the software bus */
typedef uint32 CFE_SB_MsgId_Atom_t;
typedef struct { CFE_SB_MsgId_Atom_t Value; } CFE_SB_MsgId_t;
typedef struct { uint32 id; } CFE_SB_PipeId_t;
typedef uint16 CFE_MSG_FcnCode_t;
typedef union CFE_MSG_Message { uint16 Word[3]; } CFE_MSG_Message_t; /* id, size, code */
typedef struct CFE_MSG_CommandHeader { CFE_MSG_Message_t Msg; uint8 Sec[2]; } CFE_MSG_CommandHeader_t;
typedef struct CFE_MSG_TelemetryHeader { CFE_MSG_Message_t Msg; uint8 Sec[6], Spare[4]; } CFE_MSG_TelemetryHeader_t;
typedef union CFE_SB_Msg { CFE_MSG_Message_t Msg; long long int LongInt; long double LongDouble; } CFE_SB_Buffer_t;
#define CFE_MSG_PTR(shdr) (&((shdr).Msg))
#define CFE_SB_PEND_FOREVER (-1)
#define CFE_SB_INVALID_MSG_ID CFE_SB_ValueToMsgId(0)
CFE_SB_MsgId_t CFE_SB_ValueToMsgId(CFE_SB_MsgId_Atom_t MsgIdValue);
CFE_SB_MsgId_Atom_t CFE_SB_MsgIdToValue(CFE_SB_MsgId_t MsgId);
CFE_Status_t CFE_MSG_Init(CFE_MSG_Message_t *MsgPtr, CFE_SB_MsgId_t MsgId, size_t Size);
CFE_Status_t CFE_MSG_GetSize(const CFE_MSG_Message_t *MsgPtr, size_t *Size);
CFE_Status_t CFE_MSG_GetMsgId(const CFE_MSG_Message_t *MsgPtr, CFE_SB_MsgId_t *MsgId);
CFE_Status_t CFE_MSG_GetFcnCode(const CFE_MSG_Message_t *MsgPtr, CFE_MSG_FcnCode_t *FcnCode);
CFE_Status_t CFE_SB_CreatePipe(CFE_SB_PipeId_t *PipeIdPtr, uint16 Depth, const char *PipeName);
CFE_Status_t CFE_SB_Subscribe(CFE_SB_MsgId_t MsgId, CFE_SB_PipeId_t PipeId);
CFE_Status_t CFE_SB_ReceiveBuffer(CFE_SB_Buffer_t **BufPtr, CFE_SB_PipeId_t PipeId, int32 TimeOut);
CFE_Status_t CFE_SB_TransmitMsg(const CFE_MSG_Message_t *MsgPtr, bool IsOrigination);
void CFE_SB_TimeStampMsg(CFE_MSG_Message_t *MsgPtr);

/* Tables */
typedef int16 CFE_TBL_Handle_t;
typedef int32 (*CFE_TBL_CallbackFuncPtr_t)(void *TblPtr);
typedef enum { CFE_TBL_SRC_FILE, CFE_TBL_SRC_ADDRESS } CFE_TBL_SrcEnum_t;
#define CFE_TBL_OPT_DEFAULT 0
CFE_Status_t CFE_TBL_Register(CFE_TBL_Handle_t *TblHandlePtr, const char *Name, size_t Size, uint16 TblOptionFlags,
                              CFE_TBL_CallbackFuncPtr_t TblValidationFuncPtr);
CFE_Status_t CFE_TBL_Load(CFE_TBL_Handle_t TblHandle, CFE_TBL_SrcEnum_t SrcType, const void *SrcDataPtr);
CFE_Status_t CFE_TBL_Manage(CFE_TBL_Handle_t TblHandle);
CFE_Status_t CFE_TBL_GetAddress(void **TblPtr, CFE_TBL_Handle_t TblHandle);
CFE_Status_t CFE_TBL_ReleaseAddress(CFE_TBL_Handle_t TblHandle);

/* Files */
typedef struct { uint32 ContentType, SubType, Words[6]; char Description[32]; } CFE_FS_Header_t;
void CFE_FS_InitHeader(CFE_FS_Header_t *Hdr, const char *Description, uint32 SubType);
CFE_Status_t CFE_FS_WriteHeader(osal_id_t FileDes, CFE_FS_Header_t *Hdr);

#endif
