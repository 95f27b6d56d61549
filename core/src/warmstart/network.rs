//! The transformer as a policy.

use super::{Action, Encoding, MAX_CHUNK, MAX_JOINTS, Policy};
use crate::stages::size;
use core::cell::RefCell;
use core::fmt;
use remora_nn::{Decoder, Model, Network, Storage};
use remora_qp::Checksum;
use remora_qp::time::Deadline;

// A chunk that a file may ask for has room.
const _: () = assert!(remora_nn::limit::CHUNK <= MAX_CHUNK);

/// Why a valid model cannot be a policy of Stage 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[repr(u32)]
pub enum Unfit {
    /// Its inputs are of no [`Encoding`].
    Encoding = 201,
    /// Its outputs are of no [`Action`].
    Action = 202,
    /// Its actions are not three numbers for the bus and one for each of 1 to 7 joints.
    ActionSize = 203,
    /// Its number of features is not its encoding's.
    Features = 204,
}

impl Unfit {
    /// Code of the reason for records, different from those of `remora-nn`.
    pub const fn code(self) -> u32 {
        self as u32
    }

    /// The reason in words.
    pub const fn reason(self) -> &'static str {
        match self {
            Self::Encoding => "its inputs are of an unknown encoding",
            Self::Action => "its actions are of an unknown kind",
            Self::ActionSize => "its actions have not three numbers for the bus and one a joint",
            Self::Features => "it takes another number of features than its encoding has",
        }
    }
}

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.reason())
    }
}

impl core::error::Error for Unfit {}

/// A network as the policy of the learned initial guess.
pub struct NetworkPolicy<'m, 'a, M> {
    network: RefCell<Network<'m, 'a, M>>,
    model: &'m Model<'a>,
    flow_steps: u16,
    meaning: Meaning,
}

/// Meaning of a model's inputs and outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Meaning {
    /// Its inputs.
    pub encoding: Encoding,
    /// Its outputs.
    pub action: Action,
    /// Joints of the arms it is for.
    pub joints: usize,
}

impl<'m, 'a, M: Storage> NetworkPolicy<'m, 'a, M> {
    /// A policy that asks `network`.
    ///
    /// # Errors
    /// As [`check_model`].
    pub fn new(network: Network<'m, 'a, M>) -> Result<Self, Unfit> {
        let (model, flow_steps) = (network.model(), network.flow_steps());
        let meaning = check_model(model)?;
        Ok(Self { network: RefCell::new(network), model, flow_steps, meaning })
    }
}

/// Checks that a model's inputs and outputs are those of a policy; returns what they mean.
///
/// # Errors
/// The first of [`Unfit`] that applies.
pub fn check_model(model: &Model<'_>) -> Result<Meaning, Unfit> {
    let (header, found) = (model.header(), model.dimensions());
    let encoding = Encoding::of_tag(header.inputs).ok_or(Unfit::Encoding)?;
    let action = Action::of_tag(header.outputs).ok_or(Unfit::Action)?;
    let joints = found.action.saturating_sub(size::controls(0));
    match () {
        () if !(1..=MAX_JOINTS).contains(&joints) => Err(Unfit::ActionSize),
        () if found.features != encoding.features(joints) => Err(Unfit::Features),
        () => Ok(Meaning { encoding, action, joints }),
    }
}

impl<M: Storage> Policy for NetworkPolicy<'_, '_, M> {
    fn encoding(&self) -> Encoding {
        self.meaning.encoding
    }

    fn action(&self) -> Action {
        self.meaning.action
    }

    fn nodes(&self) -> usize {
        self.model.header().nodes.into()
    }

    fn joints(&self) -> usize {
        self.meaning.joints
    }

    fn deviation(&self, features: &[f32]) -> f32 {
        self.model.deviation(features)
    }

    fn chunk(&self) -> usize {
        self.model.header().chunk.into()
    }

    /// A linear decoder's best actions are those up to the next node seen. A flow's chunk is executed in
    /// full, because the next sample may belong to another trajectory.
    fn executed(&self) -> usize {
        match self.model.header().decoder {
            Decoder::Linear => self.stride(),
            Decoder::Flow { .. } => self.chunk(),
        }
    }

    fn stride(&self) -> usize {
        self.model.dimensions().stride
    }

    fn identify(&self, checksum: &mut Checksum) {
        checksum.integer(self.model.checksum().into());
        checksum.integer(self.flow_steps.into());
    }

    fn is_intact(&self) -> bool {
        self.model.is_intact()
    }

    fn begin(&self, seed: u64) {
        if let Ok(mut network) = self.network.try_borrow_mut() {
            network.begin(seed);
        }
    }

    fn act(&self, features: &[f32], actions: &mut [f32], deadline: &Deadline<'_>) -> bool {
        let Ok(mut network) = self.network.try_borrow_mut() else { return false };
        network.act_unless(features, actions, &|| deadline.has_passed()).is_ok()
    }

    fn observe(&self, features: &[f32]) -> bool {
        let Ok(mut network) = self.network.try_borrow_mut() else { return false };
        network.observe(features).is_ok()
    }
}
