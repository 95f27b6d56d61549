/* The stub of cfe.h: one app, one pipe, tables whose files are linked, files of a folder; tasks are threads. */
#define _POSIX_C_SOURCE 200809L
#include "stub.h"

#include <pthread.h>
#include <semaphore.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

const char *StubFolder = ".";

/* Everything below is guarded by this. */
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t changed = PTHREAD_COND_INITIALIZER;

/* --- Tasks --- */

static pthread_t main_task;
static void (*main_of_app)(void);
static bool is_over, ends;
static uint32 left_with;

static void *run_main(void *unused) {
    main_of_app();
    return unused;
}

void CFE_ES_ExitApp(uint32 ExitStatus) {
    pthread_mutex_lock(&lock);
    left_with = ExitStatus;
    is_over = true;
    pthread_cond_broadcast(&changed);
    pthread_mutex_unlock(&lock);
}

bool CFE_ES_RunLoop(uint32 *RunStatus) { return *RunStatus == CFE_ES_RunStatus_APP_RUN; }

static void (*main_of_child)(void);
static size_t child_stack;

static void *run_child(void *unused) {
    main_of_child();
    return unused;
}

CFE_Status_t CFE_ES_CreateChildTask(CFE_ES_TaskId_t *TaskIdPtr, const char *TaskName,
                                    CFE_ES_ChildTaskMainFuncPtr_t FunctionPtr, CFE_ES_StackPointer_t StackPtr,
                                    size_t StackSize, CFE_ES_TaskPriority_Atom_t Priority, uint32 Flags) {
    pthread_attr_t attributes;
    pthread_t thread;
    bool is_made;
    (void)TaskIdPtr, (void)TaskName, (void)StackPtr, (void)Priority, (void)Flags;
    main_of_child = FunctionPtr;
    child_stack = StackSize;
    pthread_attr_init(&attributes);
    pthread_attr_setdetachstate(&attributes, PTHREAD_CREATE_DETACHED);
    is_made = pthread_attr_setstacksize(&attributes, child_stack + STUB_EXTRA_STACK) == 0 &&
              pthread_create(&thread, &attributes, run_child, NULL) == 0;
    return is_made ? CFE_SUCCESS : CFE_STATUS_EXTERNAL_RESOURCE_FAIL;
}

void CFE_ES_ExitChildTask(void) { pthread_exit(NULL); }

/* --- Semaphores and time --- */

static sem_t semaphores[4];
static uint32 semaphore_count;

static int32 make_semaphore(osal_id_t *id, uint32 value) {
    id->v = semaphore_count++;
    return sem_init(&semaphores[id->v], 0, value) == 0 ? OS_SUCCESS : OS_ERROR;
}

int32 OS_BinSemCreate(osal_id_t *sem_id, const char *sem_name, uint32 sem_initial_value, uint32 options) {
    (void)sem_name, (void)options;
    return make_semaphore(sem_id, sem_initial_value);
}
int32 OS_BinSemGive(osal_id_t sem_id) { return sem_post(&semaphores[sem_id.v]) == 0 ? OS_SUCCESS : OS_ERROR; }
int32 OS_BinSemTake(osal_id_t sem_id) { return sem_wait(&semaphores[sem_id.v]) == 0 ? OS_SUCCESS : OS_ERROR; }
int32 OS_MutSemCreate(osal_id_t *sem_id, const char *sem_name, uint32 options) {
    (void)sem_name, (void)options;
    return make_semaphore(sem_id, 1);
}
int32 OS_MutSemGive(osal_id_t sem_id) { return OS_BinSemGive(sem_id); }
int32 OS_MutSemTake(osal_id_t sem_id) { return OS_BinSemTake(sem_id); }

void CFE_PSP_GetTime(OS_time_t *LocalTime) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    LocalTime->ticks = (int64)now.tv_sec * 10000000 + now.tv_nsec / 100;
}
int64 OS_TimeGetTotalMicroseconds(OS_time_t tm) { return tm.ticks / 10; }

/* --- Files --- */

static FILE *files[4];

/* Where a file of the flight software lies here. */
static const char *place(char *to, size_t room, const char *path) {
    snprintf(to, room, "%s%s", StubFolder, path);
    return to;
}

int32 OS_OpenCreate(osal_id_t *filedes, const char *path, int32 flags, int32 access_mode) {
    char name[512];
    (void)flags;
    for (filedes->v = 0; filedes->v < 4; filedes->v++) {
        if (files[filedes->v] == NULL) {
            place(name, sizeof name, path);
            files[filedes->v] = fopen(name, access_mode == OS_READ_ONLY ? "rb" : "wb");
            return files[filedes->v] != NULL ? OS_SUCCESS : OS_ERROR;
        }
    }
    return OS_ERROR;
}
int32 OS_close(osal_id_t filedes) {
    FILE *file = files[filedes.v];
    files[filedes.v] = NULL;
    return fclose(file) == 0 ? OS_SUCCESS : OS_ERROR;
}
int32 OS_read(osal_id_t filedes, void *buffer, size_t nbytes) {
    /* In pieces, as an operating system may. */
    return (int32)fread(buffer, 1, nbytes < 4096 ? nbytes : 4096, files[filedes.v]);
}
int32 OS_write(osal_id_t filedes, const void *buffer, size_t nbytes) {
    return (int32)fwrite(buffer, 1, nbytes, files[filedes.v]);
}
int32 OS_remove(const char *path) {
    char name[512];
    return remove(place(name, sizeof name, path)) == 0 ? OS_SUCCESS : OS_ERROR;
}
int32 OS_rename(const char *old_filename, const char *new_filename) {
    char from[512], to[512];
    place(from, sizeof from, old_filename);
    return rename(from, place(to, sizeof to, new_filename)) == 0 ? OS_SUCCESS : OS_ERROR;
}
void CFE_FS_InitHeader(CFE_FS_Header_t *Hdr, const char *Description, uint32 SubType) {
    memset(Hdr, 0, sizeof *Hdr);
    Hdr->SubType = SubType;
    strncpy(Hdr->Description, Description, sizeof Hdr->Description - 1);
}
CFE_Status_t CFE_FS_WriteHeader(osal_id_t FileDes, CFE_FS_Header_t *Hdr) {
    Hdr->ContentType = 0x63464531;
    return OS_write(FileDes, Hdr, sizeof *Hdr);
}

/* --- Events and the log --- */

static int events[64];

CFE_Status_t CFE_EVS_Register(const void *Filters, uint16 NumEventFilters, uint16 FilterScheme) {
    (void)Filters, (void)NumEventFilters, (void)FilterScheme;
    return CFE_SUCCESS;
}
CFE_Status_t CFE_EVS_SendEvent(uint16 EventID, CFE_EVS_EventType_Enum_t EventType, const char *Spec, ...) {
    va_list arguments;
    pthread_mutex_lock(&lock);
    events[EventID]++;
    printf("event %u %u: ", EventID, EventType);
    va_start(arguments, Spec);
    vprintf(Spec, arguments);
    va_end(arguments);
    printf("\n");
    pthread_mutex_unlock(&lock);
    return CFE_SUCCESS;
}
int StubEvents(uint16 EventID) {
    int count;
    pthread_mutex_lock(&lock);
    count = events[EventID];
    pthread_mutex_unlock(&lock);
    return count;
}
CFE_Status_t CFE_ES_WriteToSysLog(const char *SpecStringPtr, ...) {
    va_list arguments;
    va_start(arguments, SpecStringPtr);
    vprintf(SpecStringPtr, arguments);
    va_end(arguments);
    return CFE_SUCCESS;
}

/* --- Messages --- */

typedef union { CFE_SB_Buffer_t Buffer; uint8 Bytes[1024]; } Room_t;
static Room_t waiting, received;
static bool is_waiting, is_idle;
static struct { CFE_SB_MsgId_Atom_t id; Room_t room; } sent[8];
static CFE_SB_MsgId_Atom_t subscribed[8];
static uint32 subscriptions;

CFE_SB_MsgId_t CFE_SB_ValueToMsgId(CFE_SB_MsgId_Atom_t MsgIdValue) {
    CFE_SB_MsgId_t id;
    id.Value = MsgIdValue;
    return id;
}
CFE_SB_MsgId_Atom_t CFE_SB_MsgIdToValue(CFE_SB_MsgId_t MsgId) { return MsgId.Value; }
CFE_Status_t CFE_MSG_Init(CFE_MSG_Message_t *MsgPtr, CFE_SB_MsgId_t MsgId, size_t Size) {
    memset(MsgPtr, 0, Size);
    MsgPtr->Word[0] = (uint16)MsgId.Value;
    MsgPtr->Word[1] = (uint16)Size;
    return CFE_SUCCESS;
}
CFE_Status_t CFE_MSG_GetSize(const CFE_MSG_Message_t *MsgPtr, size_t *Size) {
    *Size = MsgPtr->Word[1];
    return CFE_SUCCESS;
}
CFE_Status_t CFE_MSG_GetMsgId(const CFE_MSG_Message_t *MsgPtr, CFE_SB_MsgId_t *MsgId) {
    MsgId->Value = MsgPtr->Word[0];
    return CFE_SUCCESS;
}
CFE_Status_t CFE_MSG_GetFcnCode(const CFE_MSG_Message_t *MsgPtr, CFE_MSG_FcnCode_t *FcnCode) {
    *FcnCode = MsgPtr->Word[2];
    return CFE_SUCCESS;
}
CFE_Status_t CFE_SB_CreatePipe(CFE_SB_PipeId_t *PipeIdPtr, uint16 Depth, const char *PipeName) {
    (void)Depth, (void)PipeName;
    PipeIdPtr->id = 1;
    return CFE_SUCCESS;
}
CFE_Status_t CFE_SB_Subscribe(CFE_SB_MsgId_t MsgId, CFE_SB_PipeId_t PipeId) {
    (void)PipeId;
    subscribed[subscriptions++] = MsgId.Value;
    return CFE_SUCCESS;
}

/* Whoever calls this has dealt with the message before. */
CFE_Status_t CFE_SB_ReceiveBuffer(CFE_SB_Buffer_t **BufPtr, CFE_SB_PipeId_t PipeId, int32 TimeOut) {
    bool is_received;
    (void)PipeId, (void)TimeOut;
    pthread_mutex_lock(&lock);
    is_idle = true;
    pthread_cond_broadcast(&changed);
    while (!is_waiting && !ends) {
        pthread_cond_wait(&changed, &lock);
    }
    is_received = is_waiting;
    is_waiting = is_idle = false;
    received = waiting;
    pthread_mutex_unlock(&lock);
    *BufPtr = &received.Buffer;
    return is_received ? CFE_SUCCESS : -1;
}

static void wait_until_idle(void) {
    while ((!is_idle || is_waiting) && !is_over) {
        pthread_cond_wait(&changed, &lock);
    }
}

void StubSend(CFE_MSG_Message_t *Msg, CFE_SB_MsgId_Atom_t MsgId, CFE_MSG_FcnCode_t Code, size_t Size) {
    uint32 i;
    Msg->Word[0] = (uint16)MsgId;
    Msg->Word[1] = (uint16)Size;
    Msg->Word[2] = Code;
    for (i = 0; i < subscriptions && subscribed[i] != MsgId; i++) {
    }
    if (i == subscriptions || Size > sizeof waiting) {
        fprintf(stderr, "stub: nobody subscribed to 0x%lx, or it is too long\n", (unsigned long)MsgId);
        exit(2);
    }
    pthread_mutex_lock(&lock);
    memcpy(waiting.Bytes, Msg, Size);
    is_waiting = true;
    pthread_cond_broadcast(&changed);
    wait_until_idle();
    pthread_mutex_unlock(&lock);
}

CFE_Status_t CFE_SB_TransmitMsg(const CFE_MSG_Message_t *MsgPtr, bool IsOrigination) {
    uint32 i = 0;
    (void)IsOrigination;
    while (sent[i].id != 0 && sent[i].id != MsgPtr->Word[0]) {
        i++;
    }
    sent[i].id = MsgPtr->Word[0];
    memcpy(sent[i].room.Bytes, MsgPtr, MsgPtr->Word[1]);
    return CFE_SUCCESS;
}
void CFE_SB_TimeStampMsg(CFE_MSG_Message_t *MsgPtr) { (void)MsgPtr; }
const void *StubLast(CFE_SB_MsgId_Atom_t MsgId) {
    uint32 i;
    for (i = 0; i < 8; i++) {
        if (sent[i].id == MsgId) {
            return &sent[i].room;
        }
    }
    return NULL;
}

void StubStart(void (*Main)(void)) {
    main_of_app = Main;
    pthread_create(&main_task, NULL, run_main, NULL);
    pthread_mutex_lock(&lock);
    wait_until_idle();
    pthread_mutex_unlock(&lock);
}

uint32 StubStop(void) {
    pthread_mutex_lock(&lock);
    ends = true;
    pthread_cond_broadcast(&changed);
    pthread_mutex_unlock(&lock);
    pthread_join(main_task, NULL);
    return left_with;
}

/* --- Tables --- */

static struct {
    const struct StubTableFile *file;
    CFE_TBL_CallbackFuncPtr_t validate;
    bool is_new, is_updated;
} tables[2];
static const char *names[2];
static int16 table_count;

CFE_Status_t CFE_TBL_Register(CFE_TBL_Handle_t *TblHandlePtr, const char *Name, size_t Size, uint16 TblOptionFlags,
                              CFE_TBL_CallbackFuncPtr_t TblValidationFuncPtr) {
    (void)Size, (void)TblOptionFlags;
    names[table_count] = Name;
    tables[table_count].validate = TblValidationFuncPtr;
    *TblHandlePtr = table_count++;
    return CFE_SUCCESS;
}

/* Takes a table if its owner finds it valid. */
static CFE_Status_t take(int16 table, const struct StubTableFile *file) {
    CFE_Status_t status = tables[table].validate(file->Object);
    if (status == CFE_SUCCESS) {
        tables[table].file = file;
        tables[table].is_updated = true;
    }
    return status;
}

CFE_Status_t CFE_TBL_Load(CFE_TBL_Handle_t TblHandle, CFE_TBL_SrcEnum_t SrcType, const void *SrcDataPtr) {
    const struct StubTableFile *known[2] = {&StubFile_MissionTable, &StubFile_OptionsTable};
    int i;
    for (i = 0; i < 2 && SrcType == CFE_TBL_SRC_FILE; i++) {
        if (strcmp((const char *)SrcDataPtr + strlen("/cf/"), known[i]->FileName) == 0) {
            return take(TblHandle, known[i]);
        }
    }
    return -1;
}

static const struct StubTableFile *loaded[2];

void StubLoadTable(const struct StubTableFile *File) {
    int16 i;
    for (i = 0; i < table_count; i++) {
        if (strcmp(strchr(File->TableName, '.') + 1, names[i]) == 0) {
            loaded[i] = File;
        }
    }
}

CFE_Status_t CFE_TBL_Manage(CFE_TBL_Handle_t TblHandle) {
    const struct StubTableFile *file = loaded[TblHandle];
    loaded[TblHandle] = NULL;
    return file == NULL ? CFE_SUCCESS : take(TblHandle, file);
}
CFE_Status_t CFE_TBL_GetAddress(void **TblPtr, CFE_TBL_Handle_t TblHandle) {
    bool is_updated = tables[TblHandle].is_updated;
    tables[TblHandle].is_updated = false;
    *TblPtr = tables[TblHandle].file->Object;
    return is_updated ? CFE_TBL_INFO_UPDATED : CFE_SUCCESS;
}
CFE_Status_t CFE_TBL_ReleaseAddress(CFE_TBL_Handle_t TblHandle) {
    (void)TblHandle;
    return CFE_SUCCESS;
}

/* CRC-16/ARC. */
uint32 CFE_ES_CalculateCRC(const void *DataPtr, size_t DataLength, uint32 InputCRC, CFE_ES_CrcType_Enum_t TypeCRC) {
    const uint8 *byte = DataPtr;
    uint32 crc = InputCRC;
    int bit;
    (void)TypeCRC;
    for (; DataLength > 0; DataLength--, byte++) {
        crc ^= *byte;
        for (bit = 0; bit < 8; bit++) {
            crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xa001u : 0);
        }
    }
    return crc;
}
