# A stub of F Prime: the definitions that fpp-check and fpp-to-cpp ask for where a component has commands,
# events, telemetry and parameters. Not F Prime's; a component is built against the real ones in its tree.
type FwChanIdType = U32
type FwEventIdType = U32
type FwOpcodeType = U32
type FwPrmIdType = U32
type FwIndexType = I16
type FwSizeType = U64
type FwSizeStoreType = U16
type FwEnumStoreType = I32
type FwQueuePriorityType = U8

module Fw {

  type Time
  type TextLogString
  type CmdArgBuffer
  type LogBuffer
  type TlmBuffer
  type ParamBuffer

  enum CmdResponse : U8 { OK, INVALID_OPCODE, VALIDATION_ERROR, FORMAT_ERROR, EXECUTION_ERROR, BUSY, CLEARED }
  enum LogSeverity {
    FATAL = 1, WARNING_HI = 2, WARNING_LO = 3, COMMAND = 4, ACTIVITY_HI = 5, ACTIVITY_LO = 6, DIAGNOSTIC = 7
  }
  enum ParamValid { UNINIT, VALID, INVALID, DEFAULT }

  port Cmd(opCode: FwOpcodeType, cmdSeq: U32, ref args: CmdArgBuffer)
  port CmdReg(opCode: FwOpcodeType)
  port CmdResponse(opCode: FwOpcodeType, cmdSeq: U32, response: CmdResponse)
  port Log($id: FwEventIdType, ref timeTag: Time, $severity: LogSeverity, ref args: LogBuffer)
  port LogText($id: FwEventIdType, ref timeTag: Time, $severity: LogSeverity, ref $text: TextLogString)
  port PrmGet($id: FwPrmIdType, ref val: ParamBuffer) -> ParamValid
  port PrmSet($id: FwPrmIdType, ref val: ParamBuffer)
  port Time(ref $time: Time)
  port Tlm($id: FwChanIdType, ref timeTag: Time, ref val: TlmBuffer)

}

module Svc {

  port Sched(context: U32)

}
