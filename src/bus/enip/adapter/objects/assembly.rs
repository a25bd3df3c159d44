//! Assembly (class 4): 3 the image, 4 its length in bytes. The points of connections without O->T data and
//! the configuration are assemblies without bytes.
//!
//! Inputs are as for connections that monitor. Outputs are those of an owner that runs, otherwise zeros;
//! they cannot be set, owner or not: nothing would take them back when whoever set them is gone.
//! Source: choice.

use crate::bus::enip::adapter::AdapterSettings;
use crate::bus::enip::adapter::open::kind_of;
use crate::bus::enip::adapter::produce::View;
use crate::bus::enip::adapter::target::Target;
use crate::wire::enip::bytes::Writer;

pub(super) fn has_instance(settings: &AdapterSettings, instance: u32) -> bool {
    instance == settings.input_assembly
        || kind_of(instance, settings).is_some()
        || settings.config_assembly == Some(instance)
}

/// The greatest instance and how many there are.
pub(super) fn instances(settings: &AdapterSettings) -> (u16, u16) {
    let always = [
        settings.output_assembly,
        settings.input_assembly,
        settings.input_only_point,
        settings.listen_only_point,
    ];
    let all = || always.into_iter().chain(settings.config_assembly);
    let greatest = all().max().unwrap_or(0);
    (u16::try_from(greatest).unwrap_or(u16::MAX), u16::try_from(all().count()).unwrap_or(u16::MAX))
}

pub(super) fn put(target: &Target, instance: u32, attribute: u32, writer: &mut Writer<'_>) -> bool {
    let settings = &target.settings;
    let len = match instance {
        _ if instance == settings.output_assembly => settings.output_len,
        _ if instance == settings.input_assembly => settings.input_len,
        _ => 0,
    };
    match attribute {
        3 if instance == settings.input_assembly => {
            writer.put(target.inputs.view(View::Monitoring));
        }
        3 if instance == settings.output_assembly => match target.outputs() {
            Some(outputs) => writer.put(outputs),
            None => (0..len).for_each(|_| writer.u8(0)),
        },
        3 => {}
        4 => writer.u16(len),
        _ => return false,
    }
    true
}
