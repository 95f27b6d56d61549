// Plans on the component's thread, guides on a rate group's. The planner's workspace belongs to the former, the
// flight to whoever holds the component's lock.
#ifndef REMORA_PLANNER_HPP
#define REMORA_PLANNER_HPP

#include "RemoraPlannerComponentAc.hpp"

#include <remora.h>

namespace Remora {

class RemoraPlanner : public RemoraPlannerComponentBase {
  public:
    explicit RemoraPlanner(const char* compName);

    //! Opens the workspace for a mission and makes a flight with settings of guidance, nullptr for the defaults.
    //! The learned model stays where it lies; nullptr for none. To be called before the component starts.
    RemoraStatus configure(const RemoraMission& mission, const RemoraGuidance* guidance, const U8* model, size_t bytes);

  private:
    void schedIn_handler(FwIndexType portNum, U32 context) override;
    void estimateIn_handler(FwIndexType portNum, Estimate& estimate) override;
    void PLAN_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, Scenario scenario) override;
    void FLY_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, F64 begins) override;
    void REPLAN_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, F64 lead) override;
    void ABORT_cmdHandler(FwOpcodeType opCode, U32 cmdSeq) override;
    void SELF_TEST_cmdHandler(FwOpcodeType opCode, U32 cmdSeq) override;

    //! Whether no plan waits for its time: only then may the workspace be written.
    bool workspaceIsFree();
    //! How to plan, by the parameters.
    RemoraOptions options();
    //! Tells the ground what became of planning; the answer to the command.
    Fw::CmdResponse planned(RemoraStatus status);
    //! Tells the ground of a call that failed.
    void warn(const char* what, RemoraStatus status);
    //! Likewise of one of guidance; whether it failed.
    bool guidanceFailed(const char* what, RemoraStatus status);
    //! Hands the plan in the workspace to the flight once its time has come.
    void takeOver();
    //! Sends a command, and tells the ground where guidance wants something.
    void send(const RemoraCommand& command);
    //! Seconds of the component's time, for the planner.
    static double clock(void* context);

    alignas(REMORA_ALIGNMENT) U8 m_workspace[REMORA_WORKSPACE_BYTES];
    alignas(REMORA_ALIGNMENT) U8 m_flight[REMORA_FLIGHT_BYTES];
    alignas(REMORA_ALIGNMENT) U8 m_copy[REMORA_FLIGHT_BYTES];

    // The component's thread.
    const U8* m_model;
    size_t m_modelBytes;
    RemoraReport m_report;
    U32 m_plans;
    F64 m_sumSeconds;
    F64 m_longestSeconds;

    // Under the lock.
    RemoraEstimate m_estimate;
    bool m_isFresh;
    bool m_isFlying;
    bool m_isWaiting;
    F64 m_begins;
    U32 m_missed;
    U32 m_wanted;
    U32 m_mode;
};

}  // namespace Remora

#endif
