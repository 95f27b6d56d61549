/* What a test does with the stub. */
#ifndef STUB_H
#define STUB_H

#include "cfe.h"
#include "cfe_tbl_filedef.h"

/* Folder that /cf of the flight software lies in. */
extern const char *StubFolder;

/* Sends the app a message and returns once it has dealt with it. */
void StubSend(CFE_MSG_Message_t *Msg, CFE_SB_MsgId_Atom_t MsgId, CFE_MSG_FcnCode_t Code, size_t Size);

/* Starts the app's main task; it waits for messages when this returns, or has ended. */
void StubStart(void (*Main)(void));

/* Ends it; the status that it left with. */
uint32 StubStop(void);

/* How often an event came, and the newest message of an id: NULL if there is none. */
int StubEvents(uint16 EventID);
const void *StubLast(CFE_SB_MsgId_Atom_t MsgId);

/* A new table that the ground has loaded: the app takes it with its next CFE_TBL_Manage, if it is valid. */
void StubLoadTable(const struct StubTableFile *File);

#endif
