//! Options that only tools of the checkout have.

use remora_host::error::Error;
use std::path::{Path, PathBuf};

/// The sources that images and pages are made of.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct RootArgs {
    /// The checkout [default: the one around the working folder]
    #[arg(long, value_name = "DIR")]
    root: Option<PathBuf>,
}

impl RootArgs {
    /// Whether one is named.
    pub(super) fn is_given(&self) -> bool {
        self.root.is_some()
    }

    /// The checkout.
    pub(super) fn checkout(self) -> Result<PathBuf, Error> {
        const MARK: &str = "ci/firmware/Cargo.toml";
        let is_checkout = |folder: &Path| folder.join(MARK).is_file();
        if let Some(root) = self.root {
            return match is_checkout(&root) {
                true => Ok(root),
                false => {
                    let reason = format!("is no checkout: there is no {MARK}");
                    Err(Error::input(&root, "", reason))
                }
            };
        }
        let here = std::env::current_dir()
            .map_err(|cause| Error::argument("--root", format!("no working folder: {cause}")))?;
        let found = here.ancestors().find(|folder| is_checkout(folder)).map(Path::to_path_buf);
        let reason = "the working folder is in no checkout of the sources; name one";
        found.ok_or_else(|| Error::argument("--root", reason))
    }
}
