//! An NVIDIA GPU, with Burn's own operations.

use crate::kernels::Kernels;
use burn::backend::{Autodiff, Cuda};
use burn::prelude::Tensor;
use remora_host::error::in_one_line;
use std::panic::{catch_unwind, set_hook, take_hook};
use std::sync::{Arc, OnceLock};

/// The first GPU that the driver names.
pub type Gpu = Autodiff<Cuda>;

impl Kernels for Gpu {}

/// Adds two numbers on the GPU, which needs the driver, NVRTC and CUDA's headers.
///
/// # Errors
/// The one of these that is missing, in one line: Burn panics without it, in a thread of its own.
pub fn try_gpu() -> Result<(), String> {
    let said = Arc::new(OnceLock::new());
    let usual = take_hook();
    set_hook(Box::new({
        let said = said.clone();
        move |panic| {
            let text = panic.payload_as_str().unwrap_or("it does not say why");
            let _ = said.set(in_one_line(text.trim().into()));
        }
    }));
    let sum = catch_unwind(|| {
        let one = Tensor::<Cuda, 1>::ones([1], &Default::default());
        (one + 1.0).into_data().iter::<f32>().next()
    });
    set_hook(usual);
    match sum {
        Ok(Some(2.0)) => Ok(()),
        Ok(sum) => Err(format!("1 + 1 is {sum:?} there")),
        Err(_) => {
            let all = said.get().map_or("it does not say why", |text: &String| text);
            // The names of libraries that were looked for are of no use to who has none.
            Err(all.split(" - searched").next().unwrap_or(all).into())
        }
    }
}
