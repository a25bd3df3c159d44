//! A Python that knows a package which others wrote.

use std::path::{Path, PathBuf};
use std::process::Command;

/// A Python that can import `module`: the one of `FIELDARM_PYTHON`, the one that CI installs for `package`,
/// or the system's. Where there is none, the error says how to come by one; `package` is as for `pip`.
pub(crate) fn python(package: &str, module: &str) -> Result<PathBuf, String> {
    let name = package.split("==").next().unwrap_or(package);
    let named = std::env::var_os("FIELDARM_PYTHON").map(PathBuf::from);
    let installed =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("target").join(name).join("bin/python");
    let mut candidates = named.into_iter().chain([installed, "python3".into()]);
    let able = candidates.find(|python| {
        let tried = Command::new(python).args(["-c", &format!("import {module}")]).output();
        tried.is_ok_and(|tried| tried.status.success())
    });
    able.ok_or_else(|| {
        format!(
            "needs {name} (python3 -m venv target/{name}; \
             target/{name}/bin/pip install {package})"
        )
    })
}
