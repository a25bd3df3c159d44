//! One controller at a time over TCP, EtherNet/IP and PROFINET; EtherCAT shuts the others out.

use fieldarm::cycle::CyclicDevice;
use fieldarm::sim::meca500::{Controller, CyclicBus, FieldbusMode};
use fieldarm::text_device::TextDevice;
use fieldarm::wire::meca500::image::{INPUT_LEN, OutputImage, RobotControlFlags};
use fieldarm::wire::order::Big;

use crate::desk::{Desk, codes};

#[test]
fn control_is_given_once_and_given_back() {
    let mut desk = Desk::connected();
    assert!(!desk.robot.open_control(desk.now));
    for controller in [Controller::Text, Controller::EtherNetIp, Controller::Profinet] {
        assert!(!desk.robot.claim_control(controller));
    }
    // Only who has it can give it back.
    desk.robot.release_control(Controller::Profinet);
    assert_eq!(desk.robot.controller(), Some(Controller::Text));
    desk.robot.close_control(desk.now);
    assert!(desk.robot.claim_control(Controller::EtherNetIp));
    assert!(!desk.robot.open_control(desk.now));
    assert!(desk.heard().is_empty());
    desk.robot.close_control(desk.now);
    assert_eq!(desk.robot.controller(), Some(Controller::EtherNetIp));
    desk.robot.release_control(Controller::EtherNetIp);
    assert!(desk.robot.open_control(desk.now));
    assert_eq!(codes(&desk.heard()), [3000]);
}

#[test]
fn switching_to_ethercat_shuts_the_ports_until_ethercat_is_disabled() {
    let mut desk = Desk::connected();
    desk.say("EnableEtherNetIp(1)");
    assert_eq!(codes(&desk.say("SwitchToEtherCat")), [2085]);
    assert!(!desk.robot.is_on_text());
    let protocols = desk.robot.protocol_settings();
    assert!(protocols.ethercat);
    assert_eq!(protocols.ethernet_ip, FieldbusMode::Enabled);
    desk.robot.close_control(desk.now);
    assert!(!desk.robot.open_control(desk.now));
    assert!(!desk.robot.claim_control(Controller::EtherNetIp));
    assert_eq!(desk.robot.settings().bus, CyclicBus::EtherCat);
    let mut outputs = OutputImage::<Big>::zeroed();
    let mut inputs = [0; INPUT_LEN];
    desk.robot.cycle(desk.now, Some(outputs.as_bytes()), &mut inputs);
    assert!(!desk.robot.is_on_text());
    outputs.robot_control.flags.assign(RobotControlFlags::DISABLE_ETHERCAT, true);
    desk.robot.cycle(desk.now, Some(outputs.as_bytes()), &mut inputs);
    assert!(desk.robot.is_on_text());
    assert!(!desk.robot.protocol_settings().ethercat);
    assert!(desk.robot.open_control(desk.now));
    // An EtherCAT robot that nobody switched keeps its bus.
    let mut desk = Desk::connected_with(|settings| {
        settings.bus = CyclicBus::EtherCat;
        settings.persistent.ethercat_enabled = false;
    });
    assert!(!desk.robot.is_on_bus());
    desk.say("SwitchToEtherCat");
    assert!(desk.robot.is_on_bus() && !desk.robot.is_on_text());
}

#[test]
fn monitoring_needs_no_control() {
    let mut desk = Desk::connected();
    desk.robot.close_control(desk.now);
    assert!(desk.robot.claim_control(Controller::Profinet));
    let mut count = 0;
    desk.robot.monitoring_snapshot(desk.now, &mut |_| count += 1);
    assert!(count > 20);
    desk.wait_ms(30);
    assert_eq!(desk.monitored(2230).len(), 2);
}
