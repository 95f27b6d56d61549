// The component for F Prime against the stub of fprime_stub/fprime.hpp, on the base class that FPP's tools generate:
// parameters, commands, telemetry, events, a flight, planning again. Prints the checksums of two plans of the first
// public scenario, from the model and from the heuristic.
// Usage: fprime MODEL
#include "RemoraPlanner.hpp"

#include "scenarios.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>

#define CHECK(condition) \
    ((condition) ? (void)0 : (std::fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition), std::exit(1)))

namespace {

// Ids and opcodes as RemoraPlanner.fpp has them.
enum Opcode { PLAN, FLY, REPLAN, ABORT, SELF_TEST, GOAL_SET, LEARNED_SET = 13 };
enum Parameter { SUBSTEPS = 2 };
enum Channel { PLANS, LAST, MEAN, LONGEST, PLAN_STATUS, VERDICT, CHECKSUM, MODE, TRACKING_ERROR, MISSED, GUIDE_STATUS };
enum Event { PLANNED, REFUSED, FAILED, SELF_TEST_PASSED, FLYING, REPLAN_WANTED, LEAVING, MODEL_NOT_USED };

// Whatever the component is connected to.
class Ground : public Fw::PassiveComponentBase {
  public:
    std::map<U32, Fw::TlmBuffer> telemetry;
    std::map<U32, U32> events;
    std::vector<Remora::Command> commands;
    Fw::CmdResponse response;
    U32 microseconds = 0;

    void connect(Remora::RemoraPlanner& planner) {
        m_time.addCallComp(this, tell_time);
        m_tlm.addCallComp(this, keep_telemetry);
        m_log.addCallComp(this, keep_event);
        m_response.addCallComp(this, keep_response);
        m_get.addCallComp(this, get_parameter);
        m_command.addCallComp(this, keep_command);
        planner.set_timeGetOut_OutputPort(0, &m_time);
        planner.set_tlmOut_OutputPort(0, &m_tlm);
        planner.set_eventOut_OutputPort(0, &m_log);
        planner.set_cmdResponseOut_OutputPort(0, &m_response);
        planner.set_prmGetOut_OutputPort(0, &m_get);
        planner.set_commandOut_OutputPort(0, &m_command);
    }

    template <class Number>
    Number told(Channel channel) {
        Number value = Number();
        Fw::TlmBuffer buffer = telemetry[channel];
        CHECK(buffer.deserializeTo(value) == Fw::FW_SERIALIZE_OK);
        return value;
    }

  private:
    typedef Fw::PassiveComponentBase Base;
    static Ground& of(Base* component) { return *static_cast<Ground*>(component); }
    // A clock that goes on by a millisecond with each look.
    static void tell_time(Base* self, FwIndexType, Fw::Time& time) {
        const U32 now = of(self).microseconds += 1000;
        time = Fw::Time(TimeBase::TB_NONE, now / 1000000, now % 1000000);
    }
    static void keep_telemetry(Base* self, FwIndexType, FwChanIdType id, Fw::Time&, Fw::TlmBuffer& value) {
        of(self).telemetry[id] = value;
    }
    static void keep_event(Base* self, FwIndexType, FwEventIdType id, Fw::Time&, const Fw::LogSeverity&,
                           Fw::LogBuffer&) {
        of(self).events[id]++;
    }
    static void keep_response(Base* self, FwIndexType, FwOpcodeType, U32, const Fw::CmdResponse& response) {
        of(self).response = response;
    }
    static Fw::ParamValid get_parameter(Base*, FwIndexType, FwPrmIdType id, Fw::ParamBuffer& value) {
        value.resetSer();
        return id == SUBSTEPS ? ((void)value.serializeFrom(U32(4)), Fw::ParamValid::VALID) : Fw::ParamValid::INVALID;
    }
    static void keep_command(Base* self, FwIndexType, Remora::Command& command) {
        of(self).commands.push_back(command);
    }

    Fw::InputTimePort m_time;
    Fw::InputTlmPort m_tlm;
    Fw::InputLogPort m_log;
    Fw::InputCmdResponsePort m_response;
    Fw::InputPrmGetPort m_get;
    Remora::InputCommandUpdatePort m_command;
};

Ground ground;
Remora::RemoraPlanner planner("planner");
RemoraMission mission;

// Sends a command; the component's thread deals with those that it takes from its queue.
Fw::CmdResponse command(Opcode opcode, Fw::CmdArgBuffer arguments = Fw::CmdArgBuffer(), bool is_queued = true) {
    planner.get_cmdIn_InputPort(0)->invoke(opcode, 0, arguments);
    if (is_queued) {
        CHECK(static_cast<Fw::QueuedComponentBase&>(planner).doDispatch() == Fw::QueuedComponentBase::MSG_DISPATCH_OK);
    }
    return ground.response;
}
template <class Value>
Fw::CmdResponse command_with(Opcode opcode, const Value& value, bool is_queued = true) {
    Fw::CmdArgBuffer arguments;
    (void)arguments.serializeFrom(value);
    return command(opcode, arguments, is_queued);
}

Remora::Scenario first_scenario() {
    const auto& s = SCENARIOS[0];
    return Remora::Scenario(Remora::Quaternion(s.attitude), Remora::Vector3(s.rate), Remora::Vector3(s.position),
                            Remora::Vector3(s.velocity), 0.0);
}

// What navigation would say: from a flight of the same plan, that is the test's own.
alignas(REMORA_ALIGNMENT) U8 own_workspace[REMORA_WORKSPACE_BYTES];
alignas(REMORA_ALIGNMENT) U8 own_flight[REMORA_FLIGHT_BYTES];

void make_expectation(double begins) {
    RemoraScenario scenario;
    RemoraOptions options;
    RemoraReport report;
    report.size = sizeof report;
    (void)remora_defaults(REMORA_ABI, nullptr, &scenario, &options, nullptr);
    for (int i = 0; i < 3; i++) {
        scenario.target_rate_body_rad_s[i] = SCENARIOS[0].rate[i];
        scenario.com_position_rtn_m[i] = SCENARIOS[0].position[i];
        scenario.com_velocity_rtn_m_s[i] = SCENARIOS[0].velocity[i];
    }
    for (int i = 0; i < 4; i++) {
        scenario.target_attitude_body_to_rtn[i] = SCENARIOS[0].attitude[i];
    }
    CHECK(remora_open(own_workspace, sizeof own_workspace, REMORA_ABI, &mission) == REMORA_STATUS_OK);
    CHECK(remora_plan(own_workspace, &scenario, &options, &report) == REMORA_STATUS_OK);
    CHECK(remora_fly(own_flight, sizeof own_flight, REMORA_ABI, nullptr) == REMORA_STATUS_OK);
    CHECK(remora_flight_plan(own_workspace, begins, own_flight) == REMORA_STATUS_OK);
}
void wake_up() { planner.get_schedIn_InputPort(0)->invoke(0); }
void step_at(double time, double off = 0.0) {
    RemoraEstimate e;
    e.size = sizeof e;
    CHECK(remora_expected(own_flight, time, &e) == REMORA_STATUS_OK);
    e.bus_position_rtn_m[0] += off;
    Remora::Estimate estimate(
        time, Remora::Vector3(e.bus_position_rtn_m), Remora::Vector3(e.bus_velocity_rtn_m_s),
        Remora::Quaternion(e.bus_attitude_body_to_rtn), Remora::Vector3(e.bus_rate_rtn_rad_s),
        Remora::Vector3(e.joint_angle_rad), Remora::Vector3(e.joint_rate_rad_s),
        Remora::Quaternion(e.target_attitude_body_to_rtn), Remora::Vector3(e.target_rate_rtn_rad_s), false,
        Remora::Vector3(0.0));
    planner.get_estimateIn_InputPort(0)->invoke(estimate);
    wake_up();
}

void check_plans() {
    CHECK(command_with(FLY, 0.0) == Fw::CmdResponse::EXECUTION_ERROR && ground.events[FAILED] == 1);
    CHECK(command(SELF_TEST) == Fw::CmdResponse::OK && ground.events[SELF_TEST_PASSED] == 1);
    CHECK(command(PLAN) == Fw::CmdResponse::FORMAT_ERROR); // without a scenario
    CHECK(command_with(PLAN, first_scenario()) == Fw::CmdResponse::OK && ground.events[PLANNED] == 1);
    CHECK(ground.told<U32>(PLANS) == 1 && ground.told<U32>(VERDICT) == 0 && ground.told<U32>(PLAN_STATUS) == 0);
    CHECK(ground.told<F64>(LAST) > 0.0 && ground.told<F64>(LAST) == ground.told<F64>(LONGEST));
    std::printf("plan %016" PRIx64 "\n", ground.told<U64>(CHECKSUM));
    // From the heuristic, by the parameter's own command.
    CHECK(command_with(LEARNED_SET, U8(0), false) == Fw::CmdResponse::OK);
    CHECK(command_with(PLAN, first_scenario()) == Fw::CmdResponse::OK);
    std::printf("plan %016" PRIx64 "\n", ground.told<U64>(CHECKSUM));
    CHECK(ground.told<F64>(MEAN) <= ground.told<F64>(LONGEST));
    Remora::Scenario inside = first_scenario();
    inside.set_comPosition(Remora::Vector3(0.5));
    CHECK(command_with(PLAN, inside) == Fw::CmdResponse::EXECUTION_ERROR && ground.events[REFUSED] == 1);
    CHECK(ground.told<U32>(PLAN_STATUS) == REMORA_STATUS_REFUSED);
    CHECK(command_with(FLY, 0.0) == Fw::CmdResponse::EXECUTION_ERROR);
}

void check_flight() {
    make_expectation(100.0);
    wake_up();
    CHECK(command_with(PLAN, first_scenario()) == Fw::CmdResponse::OK);
    CHECK(command_with(FLY, 100.0) == Fw::CmdResponse::OK);
    CHECK(command_with(PLAN, first_scenario()) == Fw::CmdResponse::BUSY);
    step_at(99.9);
    CHECK(ground.commands.empty() && ground.events[FLYING] == 0);
    for (int i = 0; i < 10; i++) {
        step_at(100.0 + 0.1 * i);
    }
    CHECK(ground.commands.size() == 10 && ground.events[FLYING] == 1);
    CHECK(ground.commands.back().get_mode() == Remora::FlightMode::TRACK);
    wake_up();
    CHECK(ground.told<U32>(MISSED) == 1 && ground.commands.size() == 10);
    CHECK(command_with(REPLAN, 20.0) == Fw::CmdResponse::OK);
    for (double now = 104.0; now < 120.0; now += 4.0) {
        step_at(now);
    }
    CHECK(ground.events[FLYING] == 1 && ground.told<U32>(GUIDE_STATUS) == REMORA_STATUS_OK);
    step_at(121.0);
    CHECK(ground.events[FLYING] == 2 && ground.commands.back().get_mode() == Remora::FlightMode::TRACK);
    CHECK(ground.told<U32>(GUIDE_STATUS) == REMORA_STATUS_OK);
    step_at(121.1, NAN);
    CHECK(ground.commands.back().get_mode() == Remora::FlightMode::DEGRADED);
    CHECK(command(ABORT, Fw::CmdArgBuffer(), false) == Fw::CmdResponse::OK);
    step_at(121.2);
    CHECK(ground.commands.back().get_mode() == Remora::FlightMode::ABORT && ground.events[LEAVING] == 1);
    CHECK(ground.told<Remora::FlightMode>(MODE) == Remora::FlightMode::ABORT);
}

}  // namespace

int main(int count, char** arguments) {
    static U8 model[500000];
    FILE* file = count == 2 ? std::fopen(arguments[1], "rb") : nullptr;
    CHECK(file != nullptr);
    const size_t bytes = std::fread(model, 1, sizeof model, file);
    (void)std::fclose(file);
    (void)remora_defaults(REMORA_ABI, &mission, nullptr, nullptr, nullptr);
    planner.init(10, 0);
    ground.connect(planner);
    planner.loadParameters();
    CHECK(planner.configure(mission, nullptr, model, bytes) == REMORA_STATUS_OK);
    check_plans();
    check_flight();
    return 0;
}
