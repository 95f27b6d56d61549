#include "RemoraPlanner.hpp"

#include <cstring>

namespace Remora {

namespace {

//! Numbers of an FPP array to C.
template <class Array, size_t N>
void toC(const Array& from, double (&to)[N]) {
    for (U32 i = 0; i < N; i++) {
        to[i] = from[i];
    }
}

}  // namespace

RemoraPlanner::RemoraPlanner(const char* compName) : RemoraPlannerComponentBase(compName) {}

RemoraStatus RemoraPlanner::configure(const RemoraMission& mission,
                                      const RemoraGuidance* guidance,
                                      const U8* model,
                                      size_t bytes) {
    m_model = model;
    m_modelBytes = bytes;
    const RemoraStatus status = remora_open(m_workspace, sizeof m_workspace, REMORA_ABI, &mission);
    if (status != REMORA_STATUS_OK) {
        return status;
    }
    return remora_fly(m_flight, sizeof m_flight, REMORA_ABI, guidance);
}

// ----------------------------------------------------------------------
// On the component's thread
// ----------------------------------------------------------------------

void RemoraPlanner::PLAN_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, Scenario scenario) {
    this->plan(opCode, cmdSeq, scenario);
}

void RemoraPlanner::PLAN_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, const Scenario& scenario) {
    this->plan(opCode, cmdSeq, scenario);
}

void RemoraPlanner::plan(FwOpcodeType opCode, U32 cmdSeq, const Scenario& scenario) {
    if (this->isBusy(opCode, cmdSeq)) {
        return;
    }
    RemoraScenario input;
    (void)remora_defaults(REMORA_ABI, nullptr, &input, nullptr, nullptr);
    toC(scenario.get_targetAttitude(), input.target_attitude_body_to_rtn);
    toC(scenario.get_targetRateBody(), input.target_rate_body_rad_s);
    toC(scenario.get_comPosition(), input.com_position_rtn_m);
    toC(scenario.get_comVelocity(), input.com_velocity_rtn_m_s);
    input.duration_s = scenario.get_duration();
    const RemoraOptions options = this->options();
    m_report.size = sizeof m_report;
    const RemoraStatus status = remora_plan(m_workspace, &input, &options, &m_report);
    this->cmdResponse_out(opCode, cmdSeq, this->planned(status));
}

void RemoraPlanner::FLY_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, F64 begins) {
    if (this->isBusy(opCode, cmdSeq)) {
        return;
    }
    // What else may be wrong with the plan, the hand-over itself finds.
    if (m_report.is_verified == 0) {
        this->warn("fly", REMORA_STATUS_NOT_FLYABLE);
        this->cmdResponse_out(opCode, cmdSeq, Fw::CmdResponse::EXECUTION_ERROR);
        return;
    }
    this->lock();
    m_begins = begins;
    m_isWaiting = true;
    this->unLock();
    this->cmdResponse_out(opCode, cmdSeq, Fw::CmdResponse::OK);
}

void RemoraPlanner::REPLAN_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, F64 lead) {
    if (this->isBusy(opCode, cmdSeq)) {
        return;
    }
    this->lock();
    (void)std::memcpy(m_copy, m_flight, sizeof m_copy);
    const RemoraEstimate estimate = m_estimate;
    this->unLock();
    const RemoraOptions options = this->options();
    m_report.size = sizeof m_report;
    const RemoraStatus status = remora_replan(m_workspace, m_copy, &estimate, lead, &options, &m_report);
    const Fw::CmdResponse response = this->planned(status);
    if (response == Fw::CmdResponse::OK && m_report.is_verified != 0) {
        this->lock();
        m_begins = m_report.begins_s;
        m_isWaiting = true;
        this->unLock();
    }
    this->cmdResponse_out(opCode, cmdSeq, response);
}

void RemoraPlanner::SELF_TEST_cmdHandler(FwOpcodeType opCode, U32 cmdSeq) {
    if (this->isBusy(opCode, cmdSeq)) {
        return;
    }
    U64 checksum = 0;
    m_report = RemoraReport();  // The workspace holds no plan afterwards.
    const RemoraStatus status = remora_self_test(m_workspace, REMORA_INTEGRATOR_RK4, &checksum);
    this->tlmWrite_PlanStatus(status);
    if (status != REMORA_STATUS_OK) {
        this->warn("self-test", status);
        this->cmdResponse_out(opCode, cmdSeq, Fw::CmdResponse::EXECUTION_ERROR);
        return;
    }
    this->log_ACTIVITY_HI_SelfTestPassed(checksum);
    this->cmdResponse_out(opCode, cmdSeq, Fw::CmdResponse::OK);
}

bool RemoraPlanner::isBusy(FwOpcodeType opCode, U32 cmdSeq) {
    this->lock();
    const bool isWaiting = m_isWaiting;
    this->unLock();
    if (isWaiting) {
        this->cmdResponse_out(opCode, cmdSeq, Fw::CmdResponse::BUSY);
    }
    return isWaiting;
}

RemoraOptions RemoraPlanner::options() {
    Fw::ParamValid valid;
    RemoraOptions options;
    (void)remora_defaults(REMORA_ABI, nullptr, nullptr, &options, nullptr);
    options.mode = (this->paramGet_GOAL(valid) == Goal::FEASIBLE) ? REMORA_MODE_FEASIBLE : REMORA_MODE_OPTIMAL;
    const bool isEuler = this->paramGet_INTEGRATOR(valid) == Integrator::EULER;
    options.integrator = isEuler ? REMORA_INTEGRATOR_EULER : REMORA_INTEGRATOR_RK4;
    options.substeps = this->paramGet_SUBSTEPS(valid);
    const F64 deadline = this->paramGet_DEADLINE(valid);
    if (deadline > 0.0) {
        options.deadline_s = deadline;
    }
    if (this->paramGet_LEARNED(valid)) {
        options.model = m_model;
        options.model_bytes = m_modelBytes;
    }
    options.clock = clock;
    options.context = this;
    return options;
}

Fw::CmdResponse RemoraPlanner::planned(RemoraStatus status) {
    this->tlmWrite_PlanStatus(status);
    if (status == REMORA_STATUS_REFUSED) {
        m_report.is_verified = 0;
        this->log_WARNING_HI_Refused(Fw::String(m_report.refusal_name));
        return Fw::CmdResponse::EXECUTION_ERROR;
    }
    if (status != REMORA_STATUS_OK) {
        this->warn("plan", status);
        return Fw::CmdResponse::EXECUTION_ERROR;
    }
    m_plans++;
    m_sumSeconds += m_report.planning_time_s;
    m_longestSeconds = (m_report.planning_time_s > m_longestSeconds) ? m_report.planning_time_s : m_longestSeconds;
    this->tlmWrite_Plans(m_plans);
    this->tlmWrite_LastSeconds(m_report.planning_time_s);
    this->tlmWrite_MeanSeconds(m_sumSeconds / m_plans);
    this->tlmWrite_LongestSeconds(m_longestSeconds);
    this->tlmWrite_Verdict(m_report.verdict);
    this->tlmWrite_Checksum(m_report.checksum);
    // Other codes say why the heuristic took the place of a model or of the plan in force.
    if (m_report.start != REMORA_START_HEURISTIC && m_report.start != REMORA_START_MODEL &&
        m_report.start != REMORA_START_NOMINAL) {
        this->log_WARNING_LO_ModelNotUsed(m_report.start);
    }
    this->log_ACTIVITY_HI_Planned(m_report.checksum, m_report.verdict, m_report.planning_time_s);
    return Fw::CmdResponse::OK;
}

double RemoraPlanner::clock(void* context) {
    const Fw::Time time = static_cast<RemoraPlanner*>(context)->getTime();
    return time.getSeconds() + 1.0e-6 * time.getUSeconds();
}

// ----------------------------------------------------------------------
// On the threads of others, under the lock
// ----------------------------------------------------------------------

void RemoraPlanner::ABORT_cmdHandler(FwOpcodeType opCode, U32 cmdSeq) {
    m_isWaiting = false;
    const RemoraStatus status = remora_ask(m_flight, REMORA_REQUEST_ABORT);
    const bool isAsked = !this->guidanceFailed("abort", status);
    this->cmdResponse_out(opCode, cmdSeq, isAsked ? Fw::CmdResponse::OK : Fw::CmdResponse::EXECUTION_ERROR);
}

void RemoraPlanner::estimateIn_handler(FwIndexType portNum, Estimate& estimate) {
    (void)portNum;
    m_estimate.size = sizeof m_estimate;
    m_estimate.has_ee_from_port = estimate.get_hasEeFromPort() ? 1 : 0;
    m_estimate.time_s = estimate.get_time();
    toC(estimate.get_busPosition(), m_estimate.bus_position_rtn_m);
    toC(estimate.get_busVelocity(), m_estimate.bus_velocity_rtn_m_s);
    toC(estimate.get_busAttitude(), m_estimate.bus_attitude_body_to_rtn);
    toC(estimate.get_busRate(), m_estimate.bus_rate_rtn_rad_s);
    toC(estimate.get_jointAngle(), m_estimate.joint_angle_rad);
    toC(estimate.get_jointRate(), m_estimate.joint_rate_rad_s);
    toC(estimate.get_targetAttitude(), m_estimate.target_attitude_body_to_rtn);
    toC(estimate.get_targetRateRtn(), m_estimate.target_rate_rtn_rad_s);
    toC(estimate.get_eeFromPort(), m_estimate.ee_from_port_rtn_m);
    m_isFresh = true;
}

void RemoraPlanner::schedIn_handler(FwIndexType portNum, U32 context) {
    (void)portNum;
    (void)context;
    if (!m_isFresh) {
        if (m_isFlying) {
            m_missed++;
            this->tlmWrite_MissedEstimates(m_missed);
        }
        return;
    }
    m_isFresh = false;
    if (m_isWaiting && m_estimate.time_s >= m_begins) {
        this->takeOver();
    }
    if (!m_isFlying) {
        return;
    }
    RemoraCommand command;
    command.size = sizeof command;
    const RemoraStatus status = remora_guide(m_flight, &m_estimate, nullptr, &command);
    if (!this->guidanceFailed("guide", status)) {
        this->send(command);
    }
}

void RemoraPlanner::takeOver() {
    m_isWaiting = false;
    const RemoraStatus status = remora_flight_plan(m_workspace, m_begins, m_flight);
    if (!this->guidanceFailed("fly", status)) {
        m_isFlying = true;
        this->log_ACTIVITY_HI_Flying(m_begins);
    }
}

void RemoraPlanner::send(const RemoraCommand& command) {
    const FlightMode mode(static_cast<FlightMode::T>(command.mode));
    Command out(mode, Vector3(command.bus_force_rtn_n), Vector3(command.bus_torque_body_n_m),
                Vector3(command.joint_torque_n_m), Vector3(command.joint_angle_rad),
                Vector3(command.joint_rate_rad_s));
    this->commandOut_out(0, out);
    if (command.wanted != REMORA_REASON_NONE && m_wanted == REMORA_REASON_NONE) {
        this->log_WARNING_LO_ReplanWanted(command.wanted);
    }
    if (command.mode == REMORA_FLIGHT_MODE_ABORT && m_mode != FlightMode::ABORT) {
        this->log_WARNING_HI_Leaving();
    }
    m_wanted = command.wanted;
    m_mode = command.mode;
    const F64 error[3] = {command.com_error_m, command.bus_error_rad, command.joint_error_rad};
    this->tlmWrite_Mode(mode);
    this->tlmWrite_TrackingError(Vector3(error));
}

bool RemoraPlanner::guidanceFailed(const char* what, RemoraStatus status) {
    this->tlmWrite_GuideStatus(status);
    if (status != REMORA_STATUS_OK) {
        this->warn(what, status);
    }
    return status != REMORA_STATUS_OK;
}

// ----------------------------------------------------------------------
// On either thread
// ----------------------------------------------------------------------

void RemoraPlanner::warn(const char* what, RemoraStatus status) {
    this->log_WARNING_HI_Failed(Fw::String(what), Fw::String(remora_strerror(status)));
}

}  // namespace Remora
