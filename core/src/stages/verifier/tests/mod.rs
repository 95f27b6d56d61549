//! The verifier against plans made by hand.
