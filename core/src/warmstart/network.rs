//! The transformer as a policy.

use super::{Action, Encoding, Policy};
use crate::math::Checksum;
use crate::nn::{Decoder, Network, Storage};
use crate::time::Deadline;

impl<M: Storage> Policy for Network<'_, '_, M> {
    fn encoding(&self) -> Encoding {
        self.model().header().encoding
    }

    fn action(&self) -> Action {
        self.model().header().action
    }

    fn chunk(&self) -> usize {
        self.model().header().chunk.into()
    }

    /// A linear decoder's first action alone: it is the best it knows. All that a flow draws: the
    /// next draw may be another motion.
    fn executed(&self) -> usize {
        match self.model().header().decoder {
            Decoder::Linear => 1,
            Decoder::Flow { .. } => self.chunk(),
        }
    }

    fn identify(&self, checksum: &mut Checksum) {
        checksum.integer(self.model().checksum().into());
        checksum.integer(self.flow_steps().into());
    }

    fn begin(&mut self, seed: u64) {
        Network::begin(self, seed);
    }

    fn act(&mut self, features: &[f32], actions: &mut [f32], deadline: &Deadline<'_>) -> bool {
        Network::act_unless(self, features, actions, &|| deadline.has_passed()).is_ok()
    }

    fn observe(&mut self, features: &[f32]) -> bool {
        Network::observe(self, features).is_ok()
    }
}
