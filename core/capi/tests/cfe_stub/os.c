/* The stub of cfe.h: child tasks, semaphores, time, files, checksums. */
#define _POSIX_C_SOURCE 200809L
#include "stub.h"

#include <pthread.h>
#include <semaphore.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

const char *StubFolder = ".";

/* --- Child tasks --- */

static void (*main_of_child)(void);

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
    pthread_attr_init(&attributes);
    pthread_attr_setdetachstate(&attributes, PTHREAD_CREATE_DETACHED);
    is_made = pthread_attr_setstacksize(&attributes, StackSize + STUB_EXTRA_STACK) == 0 &&
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

/* --- Checksums --- */

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
