//! A motion as one MCAP file: Foxglove's own messages, and series of numbers as JSON.

use crate::epoch::Epoch;
use crate::motion::{Moment, Motion};
use crate::scene;
use foxglove::Encode;
use foxglove::messages::Timestamp;
use mcap::records::MessageHeader;
use mcap::{McapError, McapResult, WriteOptions, Writer};
use remora_core::advanced::model::Tolerances;
use remora_core::advanced::stages::Residuals;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::io::Cursor;

/// Topics, in the order of their numbers.
pub const TOPICS: [&str; 7] =
    ["/tf", "/scene", "/bus", "/joints", "/controls", "/approach", "/residuals"];

const CONTROLS: [&str; 6] = [
    "force_r_n",
    "force_t_n",
    "force_n_n",
    "bus_torque_x_n_m",
    "bus_torque_y_n_m",
    "bus_torque_z_n_m",
];
const APPROACH: [&str; 7] = [
    "position_r_m",
    "position_t_m",
    "position_n_m",
    "tip_target_x_m",
    "tip_target_y_m",
    "tip_target_z_m",
    "tip_m",
];

/// A motion as the bytes of a file, with the residuals of its plan. The first node is at `epoch`, else in 1970.
///
/// # Errors
/// An error of the writer; into memory, none that a sound motion could have.
pub fn recorded(
    motion: &Motion,
    residuals: &Residuals,
    epoch: Option<Epoch>,
) -> McapResult<Vec<u8>> {
    let misses = residuals.against(&Tolerances::default());
    let (names, values) = (misses.map(|(name, ..)| name), misses.map(|(_, value, _)| value));
    let mut tape = Tape::new(epoch)?;
    let channels = [
        tape.typed::<foxglove::messages::FrameTransforms>(TOPICS[0])?,
        tape.typed::<foxglove::messages::SceneUpdate>(TOPICS[1])?,
        tape.typed::<foxglove::messages::PoseInFrame>(TOPICS[2])?,
        tape.typed::<foxglove::messages::JointStates>(TOPICS[3])?,
        tape.series(TOPICS[4], "remora.Controls", &CONTROLS)?,
        tape.series(TOPICS[5], "remora.Approach", &APPROACH)?,
        tape.series(TOPICS[6], "remora.Residuals", &names)?,
    ];
    let [frames, bodies, bus, joints, controls, approach, plan] = channels;
    tape.say(bodies, 0, &scene::bodies(motion, tape.stamp(0)))?;
    tape.count(plan, 0, &names, &values)?;
    for moment in &motion.moments {
        let (now, stamp) = (moment.micros, tape.stamp(moment.micros));
        tape.say(frames, now, &scene::transforms(&motion.bodies, moment, stamp))?;
        tape.say(bus, now, &scene::bus_pose(moment, stamp))?;
        tape.say(joints, now, &scene::joint_states(moment, stamp))?;
        tape.count(controls, now, &CONTROLS, &control_values(moment))?;
        tape.count(approach, now, &APPROACH, &approach_values(moment))?;
    }
    tape.finish()
}

fn control_values(moment: &Moment) -> Vec<f64> {
    moment.force.iter().chain(&moment.bus_torque).copied().collect()
}

fn approach_values(moment: &Moment) -> Vec<f64> {
    let distance = moment.tip.norm();
    moment.position.iter().chain(&moment.tip).copied().chain([distance]).collect()
}

/// The file in the making.
struct Tape {
    writer: Writer<Cursor<Vec<u8>>>,
    epoch: Option<Epoch>,
    sequence: u32,
}

impl Tape {
    fn new(epoch: Option<Epoch>) -> McapResult<Self> {
        let library = concat!("remora ", env!("CARGO_PKG_VERSION"));
        let options = WriteOptions::new().compression(None).library(library);
        Ok(Self { writer: options.create(Cursor::new(Vec::new()))?, epoch, sequence: 0 })
    }

    /// Unix time of the first node, and the time since: it goes on evenly through a leap second [ns].
    fn nanos(&self, micros: i64) -> u64 {
        self.epoch.map_or(0, Epoch::nanos) + micros as u64 * 1000
    }

    fn stamp(&self, micros: i64) -> Timestamp {
        let nanos = self.nanos(micros);
        Timestamp::new((nanos / 1_000_000_000) as u32, (nanos % 1_000_000_000) as u32)
    }

    /// A channel of Foxglove's messages.
    fn typed<T: Encode>(&mut self, topic: &str) -> McapResult<u16> {
        let schema = match T::get_schema() {
            Some(schema) => self.writer.add_schema(&schema.name, &schema.encoding, &schema.data)?,
            None => 0,
        };
        self.writer.add_channel(schema, topic, &T::get_message_encoding(), &BTreeMap::new())
    }

    /// A channel of numbers with names.
    fn series(&mut self, topic: &str, name: &str, fields: &[&str]) -> McapResult<u16> {
        let field = |field: &&str| (field.to_string(), json!({ "type": "number" }));
        let properties: Map<String, Value> = fields.iter().map(field).collect();
        let schema = json!({ "title": name, "type": "object", "properties": properties });
        let schema = self.writer.add_schema(name, "jsonschema", schema.to_string().as_bytes())?;
        self.writer.add_channel(schema, topic, "json", &BTreeMap::new())
    }

    /// Adds one of Foxglove's messages.
    fn say<T: Encode>(&mut self, channel: u16, micros: i64, message: &T) -> McapResult<()> {
        let mut bytes = Vec::new();
        let encoded = message.encode(&mut bytes);
        encoded.map_err(|error| McapError::Io(std::io::Error::other(error.to_string())))?;
        self.add(channel, micros, &bytes)
    }

    /// Adds numbers.
    fn count(
        &mut self,
        channel: u16,
        micros: i64,
        fields: &[&str],
        values: &[f64],
    ) -> McapResult<()> {
        let pairs = fields.iter().zip(values);
        // A number that is none is null.
        let object: Map<String, Value> =
            pairs.map(|(field, value)| (field.to_string(), json!(value))).collect();
        self.add(channel, micros, Value::Object(object).to_string().as_bytes())
    }

    fn add(&mut self, channel_id: u16, micros: i64, bytes: &[u8]) -> McapResult<()> {
        let now = self.nanos(micros);
        let sequence = self.sequence;
        self.sequence += 1;
        let header = MessageHeader { channel_id, sequence, log_time: now, publish_time: now };
        self.writer.write_to_known_channel(&header, bytes)
    }

    fn finish(mut self) -> McapResult<Vec<u8>> {
        self.writer.finish()?;
        Ok(self.writer.into_inner().into_inner())
    }
}
