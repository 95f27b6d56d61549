// A stub of F Prime: as much of its framework as the generated base class of one component asks for, with the
// names of version 4, in one file. Not F Prime's: queues are unbounded, numbers are serialized as they lie in
// memory. Each header that generated code includes leads here.
#ifndef FPRIME_STUB_HPP
#define FPRIME_STUB_HPP

#include <cassert>
#include <cinttypes>
#include <cstdint>
#include <cstring>
#include <deque>
#include <mutex>
#include <string>
#include <type_traits>
#include <vector>

typedef uint8_t U8;
typedef uint16_t U16;
typedef uint32_t U32;
typedef uint64_t U64;
typedef int8_t I8;
typedef int16_t I16;
typedef int32_t I32;
typedef int64_t I64;
typedef double F64;
typedef U8 BYTE;
typedef int FwAssertArgType;

#include "FwChanIdTypeAliasAc.h"
#include "FwEnumStoreTypeAliasAc.h"
#include "FwEventIdTypeAliasAc.h"
#include "FwIndexTypeAliasAc.h"
#include "FwOpcodeTypeAliasAc.h"
#include "FwPrmIdTypeAliasAc.h"
#include "FwQueuePriorityTypeAliasAc.h"
#include "FwSizeStoreTypeAliasAc.h"
#include "FwSizeTypeAliasAc.h"

#define FW_ASSERT(condition, ...) assert(condition)
#define FW_NUM_ARRAY_ELEMENTS(array) (sizeof(array) / sizeof((array)[0]))
#define FW_MIN(a, b) ((a) < (b) ? (a) : (b))
#define FW_CMD_CHECK_RESIDUAL 1
#define FW_LOG_STRING_MAX_SIZE 200
#define FW_PORT_SERIALIZATION 0
#define FW_PORT_TRACING 0
#define FW_OBJECT_NAMES 0
#define FW_ENABLE_TEXT_LOGGING 0
#define FW_SERIALIZABLE_TO_STRING 0
#define FW_AMPCS_COMPATIBLE 0

enum class TimeBase { TB_NONE };

namespace Fw {

enum SerializeStatus { FW_SERIALIZE_OK, FW_DESERIALIZE_BUFFER_EMPTY, FW_DESERIALIZE_FORMAT_ERROR };

class SerializeBufferBase;

class Serializable {
  public:
    typedef FwSizeType SizeType;
    virtual SerializeStatus serializeTo(SerializeBufferBase& buffer) const = 0;
    virtual SerializeStatus deserializeFrom(SerializeBufferBase& buffer) = 0;

  protected:
    virtual ~Serializable() {}
};

// The room that derived classes offer is not used.
class SerializeBufferBase {
  public:
    virtual ~SerializeBufferBase() {}
    SerializeStatus serializeFrom(const Serializable& value) { return value.serializeTo(*this); }
    SerializeStatus serializeFrom(const SerializeBufferBase& other) {
        (void)serializeFrom(static_cast<U32>(other.m_bytes.size()));
        m_bytes.insert(m_bytes.end(), other.m_bytes.begin(), other.m_bytes.end());
        return FW_SERIALIZE_OK;
    }
    template <class Number>
    typename std::enable_if<std::is_arithmetic<Number>::value, SerializeStatus>::type serializeFrom(Number value) {
        const U8* bytes = reinterpret_cast<const U8*>(&value);
        m_bytes.insert(m_bytes.end(), bytes, bytes + sizeof value);
        return FW_SERIALIZE_OK;
    }
    SerializeStatus deserializeTo(Serializable& value) { return value.deserializeFrom(*this); }
    SerializeStatus deserializeTo(SerializeBufferBase& other) {
        U32 size = 0;
        SerializeStatus status = deserializeTo(size);
        if (status != FW_SERIALIZE_OK || getBuffLeft() < size) {
            return FW_DESERIALIZE_BUFFER_EMPTY;
        }
        const U8* from = m_bytes.data() + m_read;
        other.m_bytes.assign(from, from + size);
        m_read += size;
        return FW_SERIALIZE_OK;
    }
    template <class Number>
    typename std::enable_if<std::is_arithmetic<Number>::value, SerializeStatus>::type deserializeTo(Number& value) {
        if (getBuffLeft() < sizeof value) {
            return FW_DESERIALIZE_BUFFER_EMPTY;
        }
        (void)std::memcpy(&value, m_bytes.data() + m_read, sizeof value);
        m_read += sizeof value;
        return FW_SERIALIZE_OK;
    }
    void resetDeser() { m_read = 0; }
    void resetSer() { m_bytes.clear(); }
    FwSizeType getBuffLeft() const { return m_bytes.size() - m_read; }

    std::vector<U8> m_bytes;
    FwSizeType m_read = 0;
};

class CmdArgBuffer : public SerializeBufferBase {
  public:
    enum { SERIALIZED_SIZE = 512 };
};
class LogBuffer : public CmdArgBuffer {};
class TlmBuffer : public CmdArgBuffer {};
class ParamBuffer : public CmdArgBuffer {};

class StringBase {
  public:
    explicit StringBase(const char* text) : m_text(text) {}
    const char* toChar() const { return m_text.c_str(); }
    SerializeStatus serializeTo(SerializeBufferBase& buffer, FwSizeType most) const {
        const std::string text = m_text.substr(0, most);
        (void)buffer.serializeFrom(static_cast<U16>(text.size()));
        buffer.m_bytes.insert(buffer.m_bytes.end(), text.begin(), text.end());
        return FW_SERIALIZE_OK;
    }

  protected:
    std::string m_text;
};
class String : public StringBase {
  public:
    String(const char* text = "") : StringBase(text) {}
};
class TextLogString : public String {
  public:
    enum { SERIALIZED_SIZE = 256 };
};

class Time : public Serializable {
  public:
    enum { SERIALIZED_SIZE = 11 };
    Time() : m_seconds(0), m_useconds(0) {}
    Time(TimeBase, U32 seconds, U32 useconds) : m_seconds(seconds), m_useconds(useconds) {}
    U32 getSeconds() const { return m_seconds; }
    U32 getUSeconds() const { return m_useconds; }
    bool operator==(const Time& other) const {
        return m_seconds == other.m_seconds && m_useconds == other.m_useconds;
    }
    SerializeStatus serializeTo(SerializeBufferBase&) const override { return FW_SERIALIZE_OK; }
    SerializeStatus deserializeFrom(SerializeBufferBase&) override { return FW_SERIALIZE_OK; }

  private:
    U32 m_seconds;
    U32 m_useconds;
};
const Time ZERO_TIME;

class PassiveComponentBase {
  public:
    virtual ~PassiveComponentBase() {}
    U32 getIdBase() const { return 0; }
    void init(FwEnumStoreType) {}
};

class PortBase {
  public:
    void init() {}
    bool isConnected() const { return m_connObj != nullptr; }

  protected:
    void* m_connObj = nullptr;
};
class InputPortBase : public PortBase {
  public:
    void setPortNum(FwIndexType number) { m_portNum = number; }

  protected:
    PassiveComponentBase* m_comp = nullptr;
    FwIndexType m_portNum = 0;
};
class OutputPortBase : public PortBase {
  public:
    void setPortNum(FwIndexType) {}
};

}  // namespace Fw

namespace Os {

class Mutex {
  public:
    void lock() { m_mutex.lock(); }
    void unLock() { m_mutex.unlock(); }

  private:
    std::mutex m_mutex;
};

class Queue {
  public:
    enum Status { OP_OK, EMPTY };
    enum BlockingType { BLOCKING, NONBLOCKING };
    Status send(const Fw::SerializeBufferBase& message, FwQueuePriorityType, BlockingType) {
        m_messages.push_back(message.m_bytes);
        return OP_OK;
    }
    Status receive(Fw::SerializeBufferBase& message, BlockingType, FwQueuePriorityType&) {
        if (m_messages.empty()) {
            return EMPTY;
        }
        message.m_bytes = m_messages.front();
        m_messages.pop_front();
        return OP_OK;
    }

  private:
    std::deque<std::vector<U8>> m_messages;
};

}  // namespace Os

namespace Fw {

class QueuedComponentBase : public PassiveComponentBase {
  public:
    enum MsgDispatchStatus { MSG_DISPATCH_OK, MSG_DISPATCH_EXIT, MSG_DISPATCH_ERROR };
    Os::Queue::Status createQueue(FwSizeType, FwSizeType) { return Os::Queue::OP_OK; }
    virtual MsgDispatchStatus doDispatch() = 0;

  protected:
    Os::Queue m_queue;
};

class ActiveComponentBase : public QueuedComponentBase {
  public:
    enum { ACTIVE_COMPONENT_EXIT };
    explicit ActiveComponentBase(const char*) {}
};

}  // namespace Fw

#endif
