//! The command `fieldarm`.

fn main() {}
