//! A policy in a build with room for more joints than its arm has: it sees and answers for its own alone.

use remora_core::advanced::nn::limit::ACTIONS;
use remora_core::advanced::qp::Checksum;
use remora_core::advanced::stages::size;
use remora_core::advanced::time::Deadline;
use remora_core::advanced::warmstart::{Action, Encoding, MAX_FEATURES, Policy};

/// A policy as a build with `room` for joints asks it, for an arm of which the first `joints` are there: see
/// [`Mission::resized`](remora_core::advanced::model::Mission::resized). Features of the others are left
/// out, their actions are zero: they stand still.
pub(crate) struct PaddedPolicy<'a> {
    pub policy: &'a dyn Policy,
    pub joints: usize,
    pub room: usize,
}

impl PaddedPolicy<'_> {
    /// Hands the policy the features of its own joints.
    fn ask<T>(&self, features: &[f32], ask: impl FnOnce(&[f32]) -> T) -> T {
        let mut own = [0.0; MAX_FEATURES];
        let count =
            own_features(self.policy.encoding(), self.joints, self.room, features, &mut own);
        ask(&own[..count])
    }
}

/// Copies the features of an arm's own joints from those of a build with `room` for joints; how many they are.
pub fn own_features(
    encoding: Encoding,
    joints: usize,
    room: usize,
    features: &[f32],
    own: &mut [f32],
) -> usize {
    let (mut count, mut rest) = (0, features);
    for gap in encoding.gaps() {
        let (row, others) = rest.split_at(gap + room);
        let kept = gap + joints;
        own[count..count + kept].copy_from_slice(&row[..kept]);
        (count, rest) = (count + kept, others);
    }
    count
}

impl Policy for PaddedPolicy<'_> {
    fn encoding(&self) -> Encoding {
        self.policy.encoding()
    }

    fn action(&self) -> Action {
        self.policy.action()
    }

    fn nodes(&self) -> usize {
        self.policy.nodes()
    }

    /// Number of joints there is room for; zero, which no arm has, where the policy is for other arms.
    fn joints(&self) -> usize {
        if self.policy.joints() == self.joints { self.room } else { 0 }
    }

    fn deviation(&self, features: &[f32]) -> f32 {
        self.ask(features, |own| self.policy.deviation(own))
    }

    fn chunk(&self) -> usize {
        self.policy.chunk()
    }

    fn executed(&self) -> usize {
        self.policy.executed()
    }

    fn stride(&self) -> usize {
        self.policy.stride()
    }

    fn identify(&self, checksum: &mut Checksum) {
        self.policy.identify(checksum);
    }

    fn is_intact(&self) -> bool {
        self.policy.is_intact()
    }

    fn begin(&self, seed: u64) {
        self.policy.begin(seed);
    }

    fn act(&self, features: &[f32], actions: &mut [f32], deadline: &Deadline<'_>) -> bool {
        let [own, room] = [self.joints, self.room].map(size::controls);
        let mut answer = [0.0; ACTIONS];
        // Its own are fewer than there is room for.
        let answer = &mut answer[..actions.len() / room * own];
        if !self.ask(features, |features| self.policy.act(features, answer, deadline)) {
            return false;
        }
        actions.fill(0.0);
        for (action, own) in actions.chunks_exact_mut(room).zip(answer.chunks_exact(own)) {
            action.iter_mut().zip(own).for_each(|(x, own)| *x = *own);
        }
        true
    }

    fn observe(&self, features: &[f32]) -> bool {
        self.ask(features, |own| self.policy.observe(own))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::RefCell;

    /// Says what it sees, and answers with numbers that count.
    struct Witness {
        encoding: Encoding,
        seen: RefCell<Vec<f32>>,
    }

    impl Policy for Witness {
        fn encoding(&self) -> Encoding {
            self.encoding
        }
        fn action(&self) -> Action {
            Action::Rate
        }
        fn nodes(&self) -> usize {
            60
        }
        fn joints(&self) -> usize {
            2
        }
        fn deviation(&self, features: &[f32]) -> f32 {
            self.observe(features);
            1.5
        }
        fn chunk(&self) -> usize {
            2
        }
        fn executed(&self) -> usize {
            1
        }
        fn identify(&self, _: &mut Checksum) {}
        fn begin(&self, _: u64) {}
        fn act(&self, features: &[f32], actions: &mut [f32], _: &Deadline<'_>) -> bool {
            actions.iter_mut().zip(1..).for_each(|(x, i)| *x = i as f32);
            self.observe(features)
        }
        fn observe(&self, features: &[f32]) -> bool {
            *self.seen.borrow_mut() = features.to_vec();
            true
        }
    }

    #[test]
    fn only_the_arms_own_joints_are_seen_and_moved() {
        for encoding in [Encoding::Paper, Encoding::Body, Encoding::Servicer] {
            let policy = Witness { encoding, seen: RefCell::default() };
            let padded = PaddedPolicy { policy: &policy, joints: 2, room: 4 };
            assert_eq!(padded.joints(), 4);
            // Joint that a number belongs to, -1 where there is none.
            let columns = |joints: usize| -> Vec<f32> {
                let row =
                    |gap: &usize| vec![-1.0; *gap].into_iter().chain((0..joints).map(|i| i as f32));
                encoding.gaps().iter().flat_map(row).collect()
            };
            assert_eq!(columns(4).len(), encoding.features(4));
            let mut actions = [9.0; 14];
            assert!(padded.act(&columns(4), &mut actions, &Deadline::never()));
            let expected = [1, 2, 3, 4, 5, 0, 0, 6, 7, 8, 9, 10, 0, 0].map(|x| x as f32);
            assert_eq!(actions, expected);
            assert_eq!(*policy.seen.borrow(), columns(2));
            policy.seen.take();
            assert_eq!(padded.deviation(&columns(4)), 1.5);
            assert_eq!(*policy.seen.borrow(), columns(2));
            // For no other arm, not even one as large as the build.
            for joints in [1, 3, 4] {
                assert_eq!(PaddedPolicy { policy: &policy, joints, room: 4 }.joints(), 0);
            }
        }
    }
}
