//! A device small enough to see through, and frames to ask it with.

// Each test file uses its own part of this.
#![allow(dead_code, unreachable_pub)]

use fieldarm::bus::ethercat::application::Application;
use fieldarm::bus::ethercat::{Passage, Settings, SubDevice, pass};
use fieldarm::time::Instant;
use fieldarm::wire::ethercat::al::{AlState, AlStatusCode};
use fieldarm::wire::ethercat::command::Command;
use fieldarm::wire::ethercat::frame::{FrameBuilder, datagrams};
use fieldarm::wire::ethercat::register::SyncManagerControl;
use fieldarm::wire::ethercat::sii::{
    DcDescription, Description, FmmuUse, MailboxArea, MailboxDescription, Pdo, PdoDirection,
    PdoEntry, SiiImage, SyncManagerDescription, SyncManagerUse,
};

/// Length of the mock's outputs.
pub const OUTPUTS: usize = 4;
/// Length of the mock's inputs.
pub const INPUTS: usize = 6;

/// Answers its mailbox with the same bytes inverted; its inputs are a cycle counter, what it last
/// got as outputs, and whether it got any.
#[derive(Clone, Debug)]
pub struct Mock {
    pub output_len: usize,
    pub input_len: usize,
    pub on_bus: bool,
    pub refuse: Option<(AlState, AlStatusCode)>,
    pub cycles: Vec<(Instant, Option<Vec<u8>>)>,
    pub received: Vec<Vec<u8>>,
    pub answers: std::collections::VecDeque<Vec<u8>>,
    pub mailbox_resets: usize,
}

impl Default for Mock {
    fn default() -> Self {
        Self {
            output_len: OUTPUTS,
            input_len: INPUTS,
            on_bus: true,
            refuse: None,
            cycles: Vec::new(),
            received: Vec::new(),
            answers: std::collections::VecDeque::new(),
            mailbox_resets: 0,
        }
    }
}

impl Application for Mock {
    fn receive_mailbox(&mut self, _state: AlState, datagram: &[u8]) {
        self.received.push(datagram.to_vec());
        self.answers.push_back(datagram.iter().map(|byte| !byte).collect());
    }

    fn next_mailbox(&mut self, room: &mut [u8]) -> Option<usize> {
        let answer = self.answers.pop_front()?;
        room[..answer.len()].copy_from_slice(&answer);
        Some(answer.len())
    }

    fn reset_mailbox(&mut self) {
        self.answers.clear();
        self.mailbox_resets += 1;
    }

    fn output_len(&self) -> usize {
        self.output_len
    }

    fn input_len(&self) -> usize {
        self.input_len
    }

    fn check_transition(&mut self, _from: AlState, to: AlState) -> Result<(), AlStatusCode> {
        match self.refuse {
            Some((state, code)) if state == to => Err(code),
            _ => Ok(()),
        }
    }

    fn cycle(&mut self, now: Instant, outputs: Option<&[u8]>, inputs: &mut [u8]) {
        self.cycles.push((now, outputs.map(<[u8]>::to_vec)));
        assert_eq!(inputs.len(), self.input_len);
        if let Some(counter) = inputs.first_mut() {
            *counter = counter.wrapping_add(1);
        }
        for (place, byte) in inputs.iter_mut().skip(1).zip(outputs.unwrap_or_default()) {
            *place = *byte;
        }
        if let Some(flag) = inputs.last_mut() {
            *flag = u8::from(outputs.is_some());
        }
    }

    fn is_on_bus(&self) -> bool {
        self.on_bus
    }
}

const WATCHED_OUTPUT: SyncManagerControl = SyncManagerControl::OUTPUT
    .union(SyncManagerControl::PDI_EVENT)
    .union(SyncManagerControl::WATCHDOG);

/// The mock's sync managers: mailboxes of 32 bytes, outputs, inputs.
pub const SYNC_MANAGERS: [SyncManagerDescription; 4] = [
    SyncManagerDescription {
        start: 0x1000,
        length: 32,
        control: SyncManagerControl::MAILBOX
            .union(SyncManagerControl::OUTPUT)
            .union(SyncManagerControl::PDI_EVENT),
        enable: true,
        usage: SyncManagerUse::MailboxOut,
    },
    SyncManagerDescription {
        start: 0x1080,
        length: 32,
        control: SyncManagerControl::MAILBOX.union(SyncManagerControl::PDI_EVENT),
        enable: true,
        usage: SyncManagerUse::MailboxIn,
    },
    SyncManagerDescription {
        start: 0x1100,
        length: OUTPUTS as u16,
        control: WATCHED_OUTPUT,
        enable: true,
        usage: SyncManagerUse::Outputs,
    },
    SyncManagerDescription {
        start: 0x1400,
        length: INPUTS as u16,
        control: SyncManagerControl::PDI_EVENT,
        enable: true,
        usage: SyncManagerUse::Inputs,
    },
];

/// A device with mailboxes that speak no protocol a main device would know.
pub const DESCRIPTION: Description = Description {
    vendor: 0x1111_2222,
    product: 0x3333_4444,
    revision: 0x0001_0002,
    serial: 0x0A0B_0C0D,
    alias: 0x0123,
    pdi_control: 0x0E08,
    group: "mocks",
    order: "MOCK",
    name: "A mock",
    mailbox: Some(MailboxDescription {
        receive: MailboxArea { start: 0x1000, length: 32 },
        send: MailboxArea { start: 0x1080, length: 32 },
        protocols: 0x0020,
        coe_details: 0,
    }),
    fmmus: &[FmmuUse::Outputs, FmmuUse::Inputs, FmmuUse::MailboxState],
    sync_managers: &SYNC_MANAGERS,
    dc: Some(DcDescription { assign_activate: 0x0300, min_cycle_ns: 1_000_000 }),
};

/// The SII of the mock, with PDOs: four output bytes, six input bytes.
pub fn sii() -> SiiImage {
    let mut image = SiiImage::new(&DESCRIPTION).unwrap();
    let bytes = |index: u16, count: u8| {
        (1..=count).map(move |sub_index| PdoEntry { index, sub_index, data_type: 5, bits: 8 })
    };
    let inputs = Pdo { index: 0x1A00, sync_manager: 3, entries: bytes(0x6000, INPUTS as u8) };
    let outputs = Pdo { index: 0x1600, sync_manager: 2, entries: bytes(0x7000, OUTPUTS as u8) };
    image.push_pdos(PdoDirection::Inputs, [inputs]).unwrap();
    image.push_pdos(PdoDirection::Outputs, [outputs]).unwrap();
    image
}

pub fn device(settings: Settings) -> SubDevice<Mock> {
    SubDevice::new(Mock::default(), &DESCRIPTION, sii(), settings)
}

/// A line of mocks with the time, and one question at a time.
pub struct Bench {
    pub now: Instant,
    pub line: Vec<SubDevice<Mock>>,
}

/// What came back of a single datagram: data and working counter.
pub type Answer = (Vec<u8>, u16);

pub const SOURCE: [u8; 6] = [0x10, 0x10, 0x10, 0x10, 0x10, 0x10];

impl Bench {
    pub fn new(count: usize, settings: Settings) -> Self {
        Self { now: Instant::from_millis(1), line: vec![device(settings); count] }
    }

    /// One device with default settings.
    pub fn single() -> Self {
        Self::new(1, Settings::default())
    }

    /// Sends a frame of one datagram a microsecond later; it must come back.
    pub fn ask(&mut self, command: Command, data: &[u8]) -> Answer {
        let mut answers = self.ask_all(&[(command, data)]);
        answers.remove(0)
    }

    /// Sends a frame of several datagrams.
    pub fn ask_all(&mut self, questions: &[(Command, &[u8])]) -> Vec<Answer> {
        let mut buffer = [0; 1514];
        let mut builder = FrameBuilder::new(&mut buffer, SOURCE).unwrap();
        for (index, (command, data)) in questions.iter().enumerate() {
            builder.push(*command, index as u8, data).unwrap();
        }
        let length = builder.finish();
        self.now += fieldarm::time::Duration::from_micros(1);
        assert_eq!(pass(self.now, &mut buffer[..length], &mut self.line), Passage::Returned);
        let answers: Vec<Answer> = datagrams(&buffer[..length])
            .unwrap()
            .map(|datagram| (datagram.data.to_vec(), datagram.working_counter))
            .collect();
        assert_eq!(answers.len(), questions.len());
        answers
    }

    /// Reads from the first device.
    pub fn read(&mut self, register: u16, length: usize) -> Answer {
        self.ask(Command::Aprd { position: 0, register }, &vec![0; length])
    }

    /// Reads two bytes from the first device.
    pub fn read_u16(&mut self, register: u16) -> u16 {
        let (data, counter) = self.read(register, 2);
        assert_eq!(counter, 1, "register {register:04X}h");
        u16::from_le_bytes([data[0], data[1]])
    }

    /// Writes to the first device and returns the working counter.
    pub fn write(&mut self, register: u16, data: &[u8]) -> u16 {
        self.ask(Command::Apwr { position: 0, register }, data).1
    }

    pub fn write_u16(&mut self, register: u16, value: u16) {
        assert_eq!(self.write(register, &value.to_le_bytes()), 1, "register {register:04X}h");
    }

    /// Requests a state of the first device and returns AL status and code.
    pub fn request(&mut self, value: u16) -> (u16, u16) {
        self.write_u16(0x0120, value);
        (self.read_u16(0x0130), self.read_u16(0x0134))
    }

    /// Writes a sync manager of the first device as the SII has it, switched on or off.
    pub fn set_sync_manager(&mut self, index: u16, enable: bool) {
        let it = SYNC_MANAGERS[usize::from(index)];
        self.write_sync_manager(index, it.start, it.length, it.control.bits(), enable);
    }

    pub fn write_sync_manager(
        &mut self,
        index: u16,
        start: u16,
        length: u16,
        control: u8,
        enable: bool,
    ) {
        let register = 0x0800 + 8 * index;
        let ([a, b], [c, d]) = (start.to_le_bytes(), length.to_le_bytes());
        self.write(register + 6, &[0]);
        assert_eq!(self.write(register, &[a, b, c, d, control, 0, u8::from(enable), 0]), 1);
    }

    pub fn bring_to_pre_op(&mut self) {
        self.set_sync_manager(0, true);
        self.set_sync_manager(1, true);
        assert_eq!(self.request(2), (2, 0));
    }

    pub fn bring_to_safe_op(&mut self) {
        self.bring_to_pre_op();
        self.set_sync_manager(2, true);
        self.set_sync_manager(3, true);
        assert_eq!(self.request(4), (4, 0));
    }

    pub fn bring_to_op(&mut self) {
        self.bring_to_safe_op();
        assert_eq!(self.write(0x1100, &[0; OUTPUTS]), 1);
        assert_eq!(self.request(8), (8, 0));
    }

    pub fn millis(&mut self, millis: u64) {
        for _ in 0..millis {
            self.now += fieldarm::time::Duration::from_millis(1);
            fieldarm::bus::ethercat::tick(self.now, &mut self.line);
        }
    }
}
