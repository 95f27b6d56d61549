/* Message ids, version 1: commands 0x18xx, telemetry 0x08xx. */
#ifndef REMORA_APP_MSGIDS_H
#define REMORA_APP_MSGIDS_H

/* From the ground. */
#define REMORA_APP_CMD_MID 0x18D0
/* From the scheduler: housekeeping, and a step of guidance. */
#define REMORA_APP_SEND_HK_MID 0x18D1
#define REMORA_APP_WAKEUP_MID 0x18D2
/* From navigation. */
#define REMORA_APP_ESTIMATE_MID 0x08D2

/* To the ground, and to the actuators. */
#define REMORA_APP_HK_TLM_MID 0x08D0
#define REMORA_APP_COMMAND_MID 0x08D1

#endif
