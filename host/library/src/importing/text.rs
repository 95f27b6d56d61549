//! The mission file as text, with what it was made of.

use super::bus::shown_angles;
use super::{ImportedMission, name};

impl ImportedMission {
    /// The mission file's text; the same for the same request.
    ///
    /// # Errors
    /// A number that has no place in the file's format.
    pub fn to_text(&self) -> Result<String, toml::ser::Error> {
        let joints: Vec<&str> = self.joints.iter().map(|joint| joint.name.as_str()).collect();
        let capture: Vec<f64> = self.joints.iter().map(|joint| joint.capture_rad).collect();
        let mut lines = vec![
            format!(
                "Made by `remora mission import` of {}, robot {}.",
                name(&self.file),
                self.robot
            ),
            format!("Joints: {}.", joints.join(", ")),
            format!("Angles at capture, found when it was made: {} rad.", shown_angles(&capture)),
        ];
        lines.extend(self.decided.iter().map(|line| format!("- {line}")));
        lines.extend(self.notes.iter().map(|line| format!("- {line}")));
        // Names are the file's, and may hold anything.
        let comment = |line: String| {
            let line: String = line.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
            format!("# {line}\n")
        };
        let comments: String = lines.into_iter().map(comment).collect();
        Ok(format!("{comments}\n{}", crate::formats::toml_text::to_text(&self.mission)?))
    }
}
