//! The functions for C: the bytes are a program of calls, over structures that begin sound and are changed
//! number by number. Pointers are sound, as a caller must see to.

use remora_capi::*;
use std::ffi::c_void;

/// Most calls that plan: each takes a while.
const MOST_PLANS: usize = 2;

/// Memory of the caller's, aligned.
struct Memory(Vec<u8>, usize);

impl Memory {
    fn new(length: usize) -> Self {
        let bytes = vec![0xa5; length + REMORA_ALIGNMENT];
        let offset = bytes.as_ptr().align_offset(REMORA_ALIGNMENT);
        Self(bytes, offset)
    }

    fn pointer(&mut self) -> *mut c_void {
        self.0[self.1..].as_mut_ptr().cast()
    }
}

/// A structure of zeros with its size.
fn sized<T: Copy>() -> T {
    let mut value = std::mem::MaybeUninit::<T>::zeroed();
    // SAFETY: the structures are numbers and callbacks that may be absent, and begin with their size.
    unsafe {
        value.as_mut_ptr().cast::<u32>().write(size_of::<T>() as u32);
        value.assume_init()
    }
}

/// Overwrites eight bytes of a structure of numbers.
fn change<T: Copy>(value: &mut T, at: usize, with: [u8; 8]) {
    let at = at % (size_of::<T>() - 7);
    // SAFETY: within the structure, all bit patterns of whose members are values.
    unsafe { (&raw mut *value).cast::<u8>().add(at).cast::<[u8; 8]>().write_unaligned(with) };
}

/// Bytes that a program is read from; zeros where there is no more.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn next<const N: usize>(&mut self) -> [u8; N] {
        let (here, rest) = self.0.split_at(N.min(self.0.len()));
        self.0 = rest;
        std::array::from_fn(|i| here.get(i).copied().unwrap_or(0))
    }

    fn byte(&mut self) -> u8 {
        self.next::<1>()[0]
    }

    fn number(&mut self) -> f64 {
        f64::from_le_bytes(self.next())
    }
}

/// Stops after so many calls.
unsafe extern "C" fn stops(context: *mut c_void) -> u32 {
    // SAFETY: the context is a counter, which nobody else looks at now.
    let left = unsafe { &mut *context.cast::<u32>() };
    *left = left.saturating_sub(1);
    (*left == 0).into()
}

/// The caller.
struct Caller {
    workspace: Memory,
    flight: Memory,
    mission: RemoraMission,
    scenario: RemoraScenario,
    options: RemoraOptions,
    settings: RemoraGuidance,
    estimate: RemoraEstimate,
    limits: RemoraLimits,
    plans: usize,
    stops_after: u32,
}

impl Caller {
    fn new() -> Self {
        let (mut mission, mut scenario) = (sized(), sized());
        let (mut options, mut settings) = (sized(), sized());
        // SAFETY: places for the structures.
        let status = unsafe {
            remora_defaults(REMORA_ABI, &mut mission, &mut scenario, &mut options, &mut settings)
        };
        assert_eq!(status, RemoraStatus::Ok);
        scenario.com_position_rtn_m = [8.0, 0.0, 0.0];
        let limits = RemoraLimits {
            max_bus_force_rtn_n: [1.0; 3],
            max_bus_torque_body_n_m: [1.0; 3],
            max_joint_torque_n_m: [1.0; REMORA_JOINTS],
            ..sized()
        };
        Self {
            workspace: Memory::new(REMORA_WORKSPACE_BYTES),
            flight: Memory::new(REMORA_FLIGHT_BYTES),
            mission,
            scenario,
            options,
            settings,
            estimate: sized(),
            limits,
            plans: 0,
            stops_after: 0,
        }
    }

    /// Changes a structure.
    fn changes(&mut self, which: u8, bytes: &mut Bytes<'_>) {
        let (at, with) = (u16::from_le_bytes(bytes.next()).into(), bytes.next());
        match which {
            0 => change(&mut self.mission, at, with),
            1 => change(&mut self.scenario, at, with),
            2 => change(&mut self.settings, at, with),
            3 => change(&mut self.estimate, at, with),
            4 => change(&mut self.limits, at, with),
            _ => {
                let [mode, integrator, substeps, seed, ..] = with;
                self.options.mode = mode.into();
                self.options.integrator = integrator.into();
                self.options.substeps = substeps.into();
                self.options.seed = seed.into();
            }
        }
    }

    /// Prepares a call that plans; whether there may be one more.
    fn may_plan(&mut self, after: u8) -> bool {
        self.stops_after = u32::from(after) + 1;
        self.options.should_stop = Some(stops);
        self.plans += 1;
        self.plans <= MOST_PLANS
    }

    /// Makes a call that plans; its model is what is left of the bytes, where it is asked for one.
    fn plans(&mut self, call: u8, bytes: &mut Bytes<'_>) {
        let (after, lead) = (bytes.byte(), bytes.number());
        if !self.may_plan(after) {
            return;
        }
        let mut report = sized::<RemoraReport>();
        let (workspace, flight) = (self.workspace.pointer(), self.flight.pointer());
        self.options.context = (&raw mut self.stops_after).cast();
        let model = crate::with_checksum(bytes.0);
        if call == 8 {
            (self.options.model, self.options.model_bytes) = (model.as_ptr(), model.len());
        }
        let Self { scenario, options, estimate, .. } = self;
        // SAFETY: memory and structures of this, and the model outlives the call.
        let status = unsafe {
            match call {
                9 => remora_replan(workspace, flight, estimate, lead, options, &mut report),
                _ => remora_plan(workspace, scenario, options, &mut report),
            }
        };
        (self.options.model, self.options.model_bytes) = (std::ptr::null(), 0);
        if status == RemoraStatus::Ok {
            self.looks();
        }
    }

    /// Looks at the plan there is.
    fn looks(&mut self) {
        let (mut node, mut record) = (sized::<RemoraNode>(), sized::<RemoraRecord>());
        let mut found = sized::<RemoraVerification>();
        let workspace = self.workspace.pointer();
        // SAFETY: memory and structures of this.
        unsafe {
            for index in [0, 59, u32::MAX] {
                remora_node(workspace, index, &mut node);
            }
            remora_record(workspace, &mut record);
            remora_verify(workspace, &mut found);
        }
    }

    /// A step of guidance: what it commands is finite.
    fn guides(&mut self, is_limited: bool) {
        let mut command = sized::<RemoraCommand>();
        let limits = if is_limited { &raw const self.limits } else { std::ptr::null() };
        // SAFETY: memory and structures of this.
        let status =
            unsafe { remora_guide(self.flight.pointer(), &self.estimate, limits, &mut command) };
        if status == RemoraStatus::Ok {
            let commanded = command.bus_force_rtn_n.iter().chain(&command.bus_torque_body_n_m);
            let commanded = commanded.chain(&command.joint_torque_n_m);
            assert!(commanded.into_iter().all(|x| x.is_finite()), "{command:?}");
        }
    }

    fn calls(&mut self, call: u8, bytes: &mut Bytes<'_>) {
        let (workspace, flight) = (self.workspace.pointer(), self.flight.pointer());
        // SAFETY: memory and structures of this.
        unsafe {
            match call {
                6 => {
                    remora_open(workspace, REMORA_WORKSPACE_BYTES, REMORA_ABI, &self.mission);
                }
                7..=9 => self.plans(call, bytes),
                10 => {
                    remora_fly(flight, REMORA_FLIGHT_BYTES, REMORA_ABI, &self.settings);
                }
                11 => {
                    remora_flight_plan(workspace, bytes.number(), flight);
                }
                12 | 13 => self.guides(call == 13),
                14 => {
                    remora_expected(flight, bytes.number(), &mut self.estimate);
                }
                15 => {
                    remora_ask(flight, bytes.byte().into());
                }
                _ => self.changes(call, bytes),
            }
        }
    }
}

/// Runs a program.
pub(crate) fn run(bytes: &[u8]) {
    let (mut caller, mut bytes) = (Caller::new(), Bytes(bytes));
    for _ in 0..64 {
        if bytes.0.is_empty() {
            break;
        }
        let call = bytes.byte() % 16;
        caller.calls(call, &mut bytes);
    }
}
