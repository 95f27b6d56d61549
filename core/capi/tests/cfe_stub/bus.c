/* The stub of cfe.h: an app's main task, events, one pipe. */
#define _POSIX_C_SOURCE 200809L
#include "stub.h"

#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Guards all that follows. */
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static pthread_cond_t changed = PTHREAD_COND_INITIALIZER;

/* Whether the app has ended, and whether it is to: its pipe cannot be read then. */
static bool is_over, ends;

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

/* --- The main task --- */

static pthread_t main_task;
static void (*main_of_app)(void);
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
