//! What a Meca500 says of itself on EtherCAT: identity, mailboxes, sync managers, clock.
//!
//! The revision is 1 in every firmware although the process image changed, so it cannot tell the
//! layout. The SII of a real robot holds no PDO categories: the image is built over CoE.
//!
//! Source: capture, for identity and addresses; choice, for names and the way the firmware is
//! attached.

use crate::wire::ethercat::identity::{MECA500_PRODUCT_CODE, MECA500_REVISION, MECA500_VENDOR_ID};
use crate::wire::ethercat::register::SyncManagerControl;
use crate::wire::ethercat::sii::{
    COE_COMPLETE_ACCESS, COE_PDO_ASSIGN, COE_SDO, COE_SDO_INFO, DcDescription, Description,
    FmmuUse, MailboxArea, MailboxDescription, PROTOCOL_COE, SyncManagerDescription, SyncManagerUse,
};

/// The mailbox that the main device writes: sync manager 0.
pub const MAILBOX_RECEIVE: MailboxArea = MailboxArea { start: 0x1000, length: 128 };
/// The mailbox that the main device reads: sync manager 1.
pub const MAILBOX_SEND: MailboxArea = MailboxArea { start: 0x1080, length: 128 };
/// First address of the outputs: sync manager 2.
pub const OUTPUTS_START: u16 = 0x1100;
/// First address of the inputs: sync manager 3.
pub const INPUTS_START: u16 = 0x1400;

const MAILBOX_OUT: SyncManagerControl = SyncManagerControl::MAILBOX
    .union(SyncManagerControl::OUTPUT)
    .union(SyncManagerControl::PDI_EVENT);
const MAILBOX_IN: SyncManagerControl =
    SyncManagerControl::MAILBOX.union(SyncManagerControl::PDI_EVENT);
const OUTPUTS: SyncManagerControl = SyncManagerControl::OUTPUT
    .union(SyncManagerControl::PDI_EVENT)
    .union(SyncManagerControl::WATCHDOG);
const INPUTS: SyncManagerControl = SyncManagerControl::PDI_EVENT;

/// The description its SII is built from.
pub const DESCRIPTION: Description = Description {
    vendor: MECA500_VENDOR_ID,
    product: MECA500_PRODUCT_CODE,
    revision: MECA500_REVISION,
    serial: 0,
    alias: 0,
    pdi_control: 0x0E08,
    group: "Robots",
    order: "Meca500",
    name: "Meca500",
    mailbox: Some(MailboxDescription {
        receive: MAILBOX_RECEIVE,
        send: MAILBOX_SEND,
        protocols: PROTOCOL_COE,
        coe_details: COE_SDO | COE_SDO_INFO | COE_PDO_ASSIGN | COE_COMPLETE_ACCESS,
    }),
    fmmus: &[FmmuUse::Outputs, FmmuUse::Inputs, FmmuUse::MailboxState],
    sync_managers: &[
        SyncManagerDescription {
            start: MAILBOX_RECEIVE.start,
            length: MAILBOX_RECEIVE.length,
            control: MAILBOX_OUT,
            enable: true,
            usage: SyncManagerUse::MailboxOut,
        },
        SyncManagerDescription {
            start: MAILBOX_SEND.start,
            length: MAILBOX_SEND.length,
            control: MAILBOX_IN,
            enable: true,
            usage: SyncManagerUse::MailboxIn,
        },
        SyncManagerDescription {
            start: OUTPUTS_START,
            length: 60,
            control: OUTPUTS,
            enable: true,
            usage: SyncManagerUse::Outputs,
        },
        SyncManagerDescription {
            start: INPUTS_START,
            length: 252,
            control: INPUTS,
            enable: true,
            usage: SyncManagerUse::Inputs,
        },
    ],
    dc: Some(DcDescription { assign_activate: 0x0300, min_cycle_ns: 1_000_000 }),
};
