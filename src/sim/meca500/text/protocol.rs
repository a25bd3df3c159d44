//! Who controls the robot, and which protocols it speaks.

use crate::sim::meca500::robot::VirtualRobot;
use crate::sim::meca500::settings::{CyclicBus, FieldbusMode};

/// Who may control the robot, of those that exclude each other. EtherCAT is not among them: it
/// shuts the others out altogether. Source: PM L1778, L1855, L4101.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Controller {
    /// A connection on the control port.
    Text,
    /// An EtherNet/IP connection that owns the robot.
    EtherNetIp,
    /// A PROFINET controller.
    Profinet,
}

/// Which protocols the robot speaks now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProtocolSettings {
    /// EtherCAT mode: nothing else is spoken.
    pub ethercat: bool,
    /// EnableEtherNetIp.
    pub ethernet_ip: FieldbusMode,
    /// EnableProfinet.
    pub profinet: FieldbusMode,
    /// Keep-alive packets that may be lost before a TCP connection counts as dropped, as of the last
    /// boot.
    pub keep_alive_packets: u8,
}

impl VirtualRobot {
    /// Which protocols the robot speaks now.
    #[must_use]
    pub const fn protocol_settings(&self) -> ProtocolSettings {
        ProtocolSettings {
            ethercat: self.is_in_ethercat_mode(),
            ethernet_ip: self.settings.network.ethernet_ip,
            profinet: self.settings.network.profinet,
            keep_alive_packets: self.text.keep_alive_packets,
        }
    }

    /// Asks for control on behalf of a connection. `false` if somebody has it already, the same kind
    /// of controller included, or if the robot is in EtherCAT mode. Monitoring needs no control.
    pub fn claim_control(&mut self, controller: Controller) -> bool {
        let free = self.text.controller.is_none() && !self.is_in_ethercat_mode();
        if free {
            self.text.controller = Some(controller);
        }
        free
    }

    /// Gives control back; nothing happens unless `controller` has it.
    pub fn release_control(&mut self, controller: Controller) {
        if self.text.controller == Some(controller) {
            self.text.controller = None;
        }
    }

    /// Who controls the robot over a protocol that leaves room for others.
    #[must_use]
    pub const fn controller(&self) -> Option<Controller> {
        self.text.controller
    }

    pub(super) const fn is_in_ethercat_mode(&self) -> bool {
        matches!(self.settings.bus, CyclicBus::EtherCat)
            && self.settings.persistent.ethercat_enabled
    }

    /// SwitchToEtherCat: from now on EtherCAT is the only protocol, until DisableEtherCAT, also after a
    /// boot. Source: PM L4099.
    pub fn switch_to_ethercat(&mut self) {
        if self.settings.bus != CyclicBus::EtherCat {
            self.text.bus_before = Some(self.settings.bus);
            self.settings.bus = CyclicBus::EtherCat;
        }
        self.settings.persistent.ethercat_enabled = true;
    }

    /// DisableEtherCAT: what was spoken before SwitchToEtherCat is spoken again.
    pub(in crate::sim::meca500) fn leave_ethercat(&mut self) {
        self.settings.persistent.ethercat_enabled = false;
        if let Some(bus) = self.text.bus_before.take() {
            self.settings.bus = bus;
        }
    }
}
