//! Learned models as the planner takes them: from a file, or built in.

use crate::error::Error;
use crate::formats::{Kind, Limit, ModelRecord, read_bytes, write_atomically};
use crate::lineage;
use crate::memory::on_heap;
use crate::method::Integrator;
use remora_core::advanced::nn::{
    Memory, Model, ModelError, Network, NetworkError, Precision, ReferenceMemory, Storage,
};
use remora_core::advanced::warmstart::{NetworkPolicy, Policy, check_model};
use std::path::{Path, PathBuf};

/// The largest model that the bench runs, the paper's with five tokens a node: blocks, width, tokens.
const LAYERS: usize = 6;
const WIDTH: usize = 384;
const TOKENS: usize = 300;

/// Memory for the largest model that the bench runs; made when first asked for.
#[derive(Default)]
pub struct Memories {
    quantised: Option<Box<Memory<LAYERS, WIDTH, TOKENS>>>,
    single: Option<Box<ReferenceMemory<LAYERS, WIDTH, TOKENS>>>,
}

/// A model with its name, or why it cannot be used.
///
/// A file that is there but not a model is no error here: a plan is then made from the heuristic
/// and says why. What has been loaded stays in memory until the program ends, as a model in
/// flight does.
#[derive(Clone)]
pub struct Learned {
    name: String,
    checksum: u32,
    model: Result<Model<'static>, ModelError>,
    flow_steps: Option<u16>,
}

impl std::fmt::Debug for Learned {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { checksum, flow_steps, .. } = self;
        write!(f, "Learned({checksum:08x}, {flow_steps:?}, {:?})", self.refused())
    }
}

/// Lineages of the built-in models.
const EULER_LINEAGE: &str = include_str!("../../../fixtures/models/euler.lineage.toml");
const RK4_LINEAGE: &str = include_str!("../../../fixtures/models/rk4.lineage.toml");

impl Learned {
    /// The model in a file.
    ///
    /// # Errors
    /// The file cannot be read or is of another kind.
    pub fn read(file: &Path) -> Result<Self, Error> {
        let bytes = read_bytes(file, Limit::BINARY)?;
        let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
        let learned = Self::new(&name, bytes.leak());
        // A damaged model is kept as unusable; any other file is a mistake of the caller.
        if learned.refused().is_some() {
            Kind::Model.refuse_other(file)?;
        }
        Ok(learned)
    }

    /// The model in a file, for work that makes no sense without one.
    ///
    /// # Errors
    /// Where the file cannot be read or used.
    pub fn usable(file: &Path) -> Result<Self, Error> {
        let learned = Self::read(file)?;
        match learned.refused() {
            Some(reason) => Err(Error::input(file, "", reason)),
            None => Ok(learned),
        }
    }

    /// The built-in model of an integrator; every number of substeps has the same.
    pub fn built_in(integrator: Integrator) -> Self {
        let name = match integrator {
            Integrator::Euler => "euler.model (built in)",
            Integrator::Rk4 { .. } => "rk4.model (built in)",
        };
        Self::new(name, Self::built_in_file(integrator))
    }

    /// The bytes of that model's file.
    pub fn built_in_file(integrator: Integrator) -> &'static [u8] {
        remora_files::models::built_in(integrator)
    }

    /// Writes that model's file, and its lineage, to a folder; the file.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_built_in(integrator: Integrator, folder: &Path) -> Result<PathBuf, Error> {
        let (name, lineage) = match integrator {
            Integrator::Euler => ("euler.model", EULER_LINEAGE),
            Integrator::Rk4 { .. } => ("rk4.model", RK4_LINEAGE),
        };
        let file = folder.join(name);
        write_atomically(&file, Self::built_in_file(integrator))?;
        write_atomically(&lineage::path_of(&file), lineage.as_bytes()).map(|()| file)
    }

    /// A model of these bytes.
    pub fn new(name: &str, bytes: &'static [u8]) -> Self {
        let checksum = bytes.last_chunk().map_or(0, |last| u32::from_le_bytes(*last));
        Self { name: name.into(), checksum, model: Model::open(bytes), flow_steps: None }
    }

    /// Replaces the flow steps of the file by this number.
    pub fn with_flow_steps(self, steps: u16) -> Self {
        Self { flow_steps: Some(steps), ..self }
    }

    /// The model, where it can be used.
    pub fn model(&self) -> Option<&Model<'static>> {
        self.model.as_ref().ok()
    }

    /// Hands `work` the model at work in `memories`, or nothing where it was refused or does not
    /// fit.
    pub fn at_work<T>(
        &self,
        memories: &mut Memories,
        work: impl FnOnce(Option<&mut dyn Policy>) -> T,
    ) -> T {
        fn ready<'m, M: Storage>(
            network: Result<Network<'m, 'static, M>, NetworkError>,
            steps: Option<u16>,
        ) -> Option<NetworkPolicy<'m, 'static, M>> {
            let mut network = network.ok()?;
            network.set_flow_steps(steps);
            NetworkPolicy::new(network).ok()
        }
        let Ok(model) = &self.model else { return work(None) };
        match model.header().precision {
            Precision::Int8 => {
                let memory = memories.quantised.get_or_insert_with(|| on_heap(Memory::new));
                let mut network = ready(Network::new(model, &mut **memory), self.flow_steps);
                work(network.as_mut().map(|policy| policy as &mut dyn Policy))
            }
            Precision::F32 => {
                let memory = memories.single.get_or_insert_with(|| on_heap(Memory::new));
                let mut network = ready(Network::new(model, &mut **memory), self.flow_steps);
                work(network.as_mut().map(|policy| policy as &mut dyn Policy))
            }
        }
    }

    /// Reason why it cannot be used: as a model file, as a policy, or because it is too large.
    pub fn refused(&self) -> Option<&'static str> {
        let model = match &self.model {
            Ok(model) => model,
            Err(error) => return Some(error.reason()),
        };
        if let Err(unfit) = check_model(model) {
            return Some(unfit.reason());
        }
        let size = model.dimensions();
        let fits = size.layers <= LAYERS && size.width <= WIDTH && size.tokens <= TOKENS;
        (!fits).then(|| NetworkError::Memory.reason())
    }

    /// Steps of the flow, where they are not the file's.
    pub fn flow_steps(&self) -> Option<u16> {
        self.flow_steps
    }

    /// The file's last four bytes: its CRC-32.
    pub fn checksum(&self) -> u32 {
        self.checksum
    }

    /// The model's record for the evidence.
    pub fn record(&self) -> ModelRecord {
        ModelRecord {
            name: self.name.clone(),
            checksum: format!("{:08x}", self.checksum),
            refused: self.refused().map(Into::into),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use remora_core::advanced::nn::{
        Decoder, Header, Layout, Provenance, VERSION, synthetic_model,
    };
    use remora_core::advanced::warmstart::Encoding;

    fn learned(inputs: u8, features: u16, width: u16) -> Learned {
        let header = Header {
            version: VERSION,
            precision: Precision::Int8,
            layout: Layout::Fused,
            inputs,
            outputs: 0,
            decoder: Decoder::Linear,
            chunk: 1,
            nodes: 60,
            layers: 1,
            heads: 2,
            width,
            token_types: [features].into_iter().collect(),
            provenance: Provenance::default(),
            action: 6,
        };
        let mut file = vec![0; 4 << 20];
        let length = synthetic_model(&header, 1, &mut file).unwrap();
        file.truncate(length);
        Learned::new("a.model", file.leak())
    }

    /// A valid model that cannot be a policy says why in the record of a plan.
    #[test]
    fn an_unfit_model_is_refused_with_its_reason() {
        let reason = |learned: Learned| {
            assert!(learned.at_work(&mut Memories::default(), |policy| policy.is_none()));
            learned.record().refused.unwrap()
        };
        assert_eq!(reason(learned(99, 36, 32)), "its inputs are of an unknown encoding");
        let other = "it takes another number of features than its encoding has";
        assert_eq!(reason(learned(Encoding::Paper.tag(), 7, 32)), other);
        let too_large = "the model is larger than the memory set aside for it";
        assert_eq!(
            reason(learned(Encoding::Paper.tag(), Encoding::Paper.features(3) as u16, 512)),
            too_large
        );
        let sound = learned(Encoding::Paper.tag(), Encoding::Paper.features(3) as u16, 32);
        assert_eq!(sound.refused(), None);
        assert!(sound.at_work(&mut Memories::default(), |policy| policy.is_some()));
    }
}
