//! Where to compute.

use remora_host::error::Error;
use remora_training::{Cpu, Observer, Outcome, Run};

/// Where to compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Device {
    Cpu,
    #[cfg(feature = "cuda")]
    Cuda,
}

impl Device {
    /// Whether it is there.
    ///
    /// # Errors
    /// A device that is missing.
    pub(super) fn check(self) -> Result<(), Error> {
        match self {
            Self::Cpu => Ok(()),
            #[cfg(feature = "cuda")]
            Self::Cuda => remora_training::try_gpu()
                .map_err(|reason| Error::argument("--device", format!("cuda: {reason}"))),
        }
    }

    pub(super) fn train(
        self,
        run: &Run<'_>,
        observer: &mut dyn Observer,
    ) -> Result<Outcome, Error> {
        match self {
            Self::Cpu => run.train::<Cpu>(Default::default(), observer),
            #[cfg(feature = "cuda")]
            Self::Cuda => run.train::<remora_training::Gpu>(Default::default(), observer),
        }
    }
}
