//! The command `fieldarm`; everything it does is in [`fieldarm::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    fieldarm::cli::main()
}
