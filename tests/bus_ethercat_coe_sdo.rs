//! SDO transfers byte by byte, as ETG.1000 part 6 lays them out.

mod coe_support;

use coe_support::*;
use fieldarm::bus::ethercat::application::Application;
use fieldarm::bus::ethercat::meca500::Meca500Settings;

#[test]
fn small_values_are_read_expedited() {
    let mut firmware = firmware(Meca500Settings { serial: 0x1234_5678, ..Default::default() });
    dialogue(
        &mut firmware,
        &[
            ("00 20 40 18 10 01 00 00 00 00", "00 30 43 18 10 01 E1 AD EC 00"),
            ("00 20 40 18 10 02 00 00 00 00", "00 30 43 18 10 02 00 D5 04 00"),
            ("00 20 40 18 10 03 00 00 00 00", "00 30 43 18 10 03 01 00 00 00"),
            ("00 20 40 18 10 04 00 00 00 00", "00 30 43 18 10 04 78 56 34 12"),
            ("00 20 40 18 10 00 00 00 00 00", "00 30 4F 18 10 00 04 00 00 00"),
            ("00 20 40 12 1C 01 00 00 00 00", "00 30 4B 12 1C 01 00 16 00 00"),
        ],
    );
}

#[test]
fn the_power_up_assignment_is_the_whole_image() {
    let firmware = firmware(Meca500Settings::default());
    assert_eq!((firmware.output_len(), firmware.input_len()), (60, 252));
}
