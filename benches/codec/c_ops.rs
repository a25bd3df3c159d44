//! The hand-written C of `codec.c`, compiled and loaded when the bench starts.

use std::path::Path;
use std::process::Command;

use fieldarm::wire::meca500::image::{INPUT_LEN, OUTPUT_LEN, OutputValues};
use libloading::Library;

/// `struct input_values`; neighbouring fields of one type are arrays here.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Input {
    status: [bool; 10],
    integers: [u16; 5],
    motion: [bool; 6],
    offline_program_id: u16,
    joint_and_pose: [[f32; 6]; 2],
    configuration: [i8; 4],
    wrf_and_trf: [[f32; 6]; 2],
    timestamp: [u32; 3],
    signals_and_resettable: [[bool; 11]; 2],
    operation_mode: u8,
    power: [bool; 2],
    psu: [bool; 6],
    dynamic_data: [Slot; 4],
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
struct Slot {
    dynamic_type: u32,
    value_idx: [f32; 6],
}

/// `struct output_values`; neighbouring fields of one type are arrays here.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Output {
    control: [bool; 7],
    move_id: u16,
    motion: [bool; 5],
    motion_command_id: u32,
    argument: [f32; 6],
    host_time: u32,
    brakes: [bool; 2],
    dynamic_data_type_id: [u32; 4],
}

impl From<&OutputValues> for Output {
    fn from(values: &OutputValues) -> Self {
        let control = values.robot_control.flags;
        let motion = values.motion_control.flags;
        let brakes = values.brakes_control.flags;
        Self {
            control: [
                control.deactivate_robot,
                control.activate_robot,
                control.home,
                control.reset_error,
                control.activate_sim,
                control.enable_recovery_mode,
                control.disable_ethercat,
            ],
            move_id: values.motion_control.move_id,
            motion: [
                motion.set_point,
                motion.pause_motion,
                motion.clear_motion,
                motion.resume_motion,
                motion.use_variables,
            ],
            motion_command_id: values.motion_command.motion_command_id,
            argument: values.motion_command_args.argument,
            host_time: values.host_time.host_time,
            brakes: [brakes.brakes_control_allowed, brakes.brakes_engaged],
            dynamic_data_type_id: values.dynamic_data_configuration.dynamic_data_type_id,
        }
    }
}

/// `struct cycle_reads`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Reads {
    pub(crate) status_bits: u16,
    pub(crate) error_code: u16,
    pub(crate) checkpoint_reached: u16,
    pub(crate) checkpoint_discarded: u16,
    pub(crate) move_id: u16,
    pub(crate) fifo_space: u16,
    pub(crate) motion_bits: u16,
    pub(crate) seconds: u32,
    pub(crate) microseconds: u32,
    pub(crate) signal_bits: u32,
    pub(crate) resettable_bits: u32,
    pub(crate) dynamic_types: [u32; 4],
}

/// The functions of `codec.c` in one byte order.
#[derive(Clone, Copy)]
pub(crate) struct Ops {
    decode: unsafe extern "C" fn(*const u8, *mut Input),
    encode: unsafe extern "C" fn(*const Output, *mut u8),
    reads: unsafe extern "C" fn(*const u8, *mut Reads),
}

impl Ops {
    #[inline]
    pub(crate) fn decode(self, bytes: &[u8; INPUT_LEN], values: &mut Input) {
        // SAFETY: the function reads 252 bytes and writes one `struct input_values`, which
        // `Input` mirrors.
        unsafe { (self.decode)(bytes.as_ptr(), values) }
    }

    #[inline]
    pub(crate) fn encode(self, values: &Output, bytes: &mut [u8; OUTPUT_LEN]) {
        // SAFETY: the function reads one `struct output_values`, which `Output` mirrors, and
        // writes 60 bytes.
        unsafe { (self.encode)(values, bytes.as_mut_ptr()) }
    }

    #[inline]
    pub(crate) fn reads(self, bytes: &[u8; INPUT_LEN], reads: &mut Reads) {
        // SAFETY: the function reads within 252 bytes and writes one `struct cycle_reads`, which
        // `Reads` mirrors.
        unsafe { (self.reads)(bytes.as_ptr(), reads) }
    }
}

/// The C in big- and little-endian, loaded for the life of the process.
///
/// # Errors
///
/// Why there is none, e.g. that no C compiler is installed.
pub(crate) fn load() -> Result<(Ops, Ops), String> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/codec/codec.c");
    let object = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!(
        "codec-{}{}",
        std::process::id(),
        std::env::consts::DLL_SUFFIX
    ));
    let status = Command::new("cc")
        .args(["-std=c11", "-O2", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared", "-o"])
        .args([&object, &source])
        .status()
        .map_err(|error| format!("cc does not start ({error})"))?;
    if !status.success() {
        return Err(format!("cc ended with {status}"));
    }
    // SAFETY: the library is `codec.c`, which has no initialisers.
    let library = unsafe { Library::new(&object) }.map_err(|error| error.to_string())?;
    let _ = std::fs::remove_file(&object);
    let library: &'static Library = Box::leak(Box::new(library));
    Ok((ops(library, "big")?, ops(library, "little")?))
}

fn ops(library: &'static Library, order: &str) -> Result<Ops, String> {
    Ok(Ops {
        decode: symbol(library, &format!("measured_c_decode_{order}"))?,
        encode: symbol(library, &format!("measured_c_encode_{order}"))?,
        reads: symbol(library, &format!("measured_c_reads_{order}"))?,
    })
}

/// `F` is the function's type as `codec.c` spells it; [`ops`] alone calls this.
fn symbol<F: Copy>(library: &'static Library, name: &str) -> Result<F, String> {
    // SAFETY: every name that `ops` asks for is a function of the type of the field it fills.
    unsafe { library.get::<F>(name.as_bytes()) }
        .map(|symbol| *symbol)
        .map_err(|error| error.to_string())
}
