//! `--state DIR`: what the robots keep while their power is off, kept over the end of the process.
//!
//! ```text
//! open --> furnish, fill --> keep, keep, ... --> end
//! locks    robots are made   each pass           the last state is on the disk
//! ```
//!
//! A file a robot, `robot-1.json` and so on ([`Kept`]). It is written by a thread of its own: to the
//! side first, and put in place of the old one only when it is whole. A directory serves one process at a
//! time, which a lock on the file `lock` in it sees to.
//!
//! Invariants: a file that cannot be read is never written; the robots never wait for the disk; what has
//! changed is on its way to the disk within [`INTERVAL`].

use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::prelude::v1::*;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

use super::cell::Cell;
use super::kept::Kept;
use crate::cli::exit::{Exit, Failure};
use crate::sim::meca500::{
    FieldbusMode, NetworkSettings, PersistentSettings, RobotSettings, VirtualRobot,
};
use crate::time::{Duration, Instant};

/// Time between two looks at the robots, and least time between two writings.
const INTERVAL: Duration = Duration::from_secs(1);

/// The directory, and what is in it.
pub(super) struct State {
    directory: PathBuf,
    /// Held until the end of the process.
    _lock: File,
    /// What each robot's file held; `None` where there was none.
    found: Vec<Option<Kept>>,
    /// What each robot was like when it was last handed to the writer.
    written: Vec<Option<Mark>>,
    next_look: Option<Instant>,
    /// What the disk refused when that was told last.
    told: Option<String>,
    writer: Writer,
}

/// Enough of a robot to see that its file is out of date.
#[derive(Clone, Debug, PartialEq)]
struct Mark {
    persistent: PersistentSettings,
    network: NetworkSettings,
    is_in_ethercat_mode: bool,
    store: u64,
    joints: [f64; 6],
}

impl Mark {
    fn of(robot: &VirtualRobot) -> Self {
        Self {
            persistent: robot.settings().persistent,
            network: robot.settings().network.clone(),
            is_in_ethercat_mode: robot.protocol_settings().ethercat,
            store: robot.store_revision(),
            joints: robot.target_joints(),
        }
    }
}

impl State {
    /// Makes the directory unless it is there, locks it, and reads the files of so many robots.
    pub(super) fn open(directory: &Path, robots: usize) -> Result<Self, Failure> {
        let name = directory.display();
        let cannot = |what: &str, error: io::Error| {
            Failure::internal(format!("--state {name}: cannot {what}: {error}"))
        };
        fs::create_dir_all(directory).map_err(|error| cannot("make this directory", error))?;
        let lock = File::options()
            .write(true)
            .create(true)
            .truncate(false)
            .open(directory.join("lock"))
            .map_err(|error| cannot("open the file `lock` in it", error))?;
        lock.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => Failure::internal(format!(
                "--state {name}: another process serves robots from this directory; end that one or name \
                 another directory"
            )),
            TryLockError::Error(error) => cannot("lock the file `lock` in it", error),
        })?;
        let found = (0..robots)
            .map(|number| read(&file_of(directory, number)))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            directory: directory.into(),
            _lock: lock,
            found,
            written: vec![None; robots],
            next_look: None,
            told: None,
            writer: Writer::start(directory),
        })
    }

    /// Whether the file of a robot says that it was switched to EtherCAT; `None` without a file.
    pub(super) fn is_in_ethercat_mode(&self, number: usize) -> Option<bool> {
        self.found.get(number)?.as_ref().map(Kept::is_in_ethercat_mode)
    }

    /// Puts what the robot had kept into the settings that it is about to be made of. What the command
    /// line serves is enabled all the same; returns what is to be told of that.
    pub(super) fn furnish(
        &self,
        number: usize,
        settings: &mut RobotSettings,
    ) -> Result<Option<String>, Failure> {
        let Some(Some(kept)) = self.found.get(number) else { return Ok(None) };
        if kept.serial_number != settings.serial_number {
            return Err(self.wrong(
                number,
                &format!(
                    "it belongs to the robot with serial number {}, not to {}",
                    kept.serial_number, settings.serial_number
                ),
            ));
        }
        let asked = settings.network.ethernet_ip;
        kept.furnish(settings).map_err(|why| self.wrong(number, &why))?;
        let kept = &mut settings.network.ethernet_ip;
        let overrides = match asked {
            FieldbusMode::Disabled => false,
            FieldbusMode::Enabled => *kept == FieldbusMode::Disabled,
            FieldbusMode::MonitoringOnly => *kept != FieldbusMode::MonitoringOnly,
        };
        if !overrides {
            return Ok(None);
        }
        *kept = asked;
        Ok(Some(format!("EnableEtherNetIp({}) by the command line", asked.number())))
    }

    /// Puts variables and programs into the robot, which was made of these settings.
    pub(super) fn fill(&self, number: usize, robot: &mut VirtualRobot) -> Result<(), Failure> {
        let Some(Some(kept)) = self.found.get(number) else { return Ok(()) };
        kept.fill(robot).map_err(|why| self.wrong(number, &why))
    }

    fn wrong(&self, number: usize, why: &str) -> Failure {
        mistake(&file_of(&self.directory, number), &format!(" {why}"))
    }

    /// Sees to it that what has changed is written; says what the disk refused since the last time.
    pub(super) fn keep<C: Cell>(&mut self, cell: &mut C) -> Option<String> {
        let now = cell.now();
        if self.next_look.is_some_and(|next| now < next) {
            return None;
        }
        self.next_look = Some(now + INTERVAL);
        let mut news = None;
        for (number, refusal) in self.writer.refusals() {
            // It is tried again, and told again only when it is about something else.
            self.written[number] = None;
            self.found[number] = None;
            if self.told.as_ref() != Some(&refusal) {
                news = Some(refusal.clone());
                self.told = Some(refusal);
            }
        }
        self.look(cell);
        news
    }

    /// Hands out-of-date robots to the writer.
    fn look<C: Cell>(&mut self, cell: &mut C) {
        for (number, written) in self.written.iter_mut().enumerate().take(cell.count()) {
            let robot = cell.robot(number);
            let mut mark = Mark::of(&robot);
            // Where a moving arm is changes all the time; where it stops is worth a line.
            if robot.standing().moving
                && let Some(written) = written
            {
                mark.joints = written.joints;
            }
            if written.as_ref() != Some(&mark) {
                *written = Some(mark);
                let kept = Kept::of(&robot);
                // At the first look most robots are as their files say.
                if self.found[number].take().as_ref() != Some(&kept) {
                    self.writer.hand_over(number, kept);
                }
            }
        }
    }

    /// Writes what is left to be written, and waits for the disk.
    pub(super) fn end<C: Cell>(mut self, cell: &mut C) -> Result<(), Failure> {
        self.next_look = None;
        self.keep(cell);
        match self.writer.end() {
            None => Ok(()),
            Some(refusal) => Err(Failure::internal(refusal)),
        }
    }
}

fn file_of(directory: &Path, number: usize) -> PathBuf {
    directory.join(format!("robot-{}.json", number + 1))
}

/// Reads a robot's file, if it is there.
fn read(path: &Path) -> Result<Option<Kept>, Failure> {
    let text = match fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) if error.kind() == ErrorKind::InvalidData => {
            return Err(mistake(path, " it is no text (UTF-8)"));
        }
        Err(error) => {
            let name = path.display();
            return Err(Failure::internal(format!("--state: cannot read {name}: {error}")));
        }
    };
    Kept::read(&text).map(Some).map_err(|why| mistake(path, &why))
}

/// A file with a mistake in it, which is left as it is.
fn mistake(path: &Path, why: &str) -> Failure {
    let name = path.display();
    let message = format!(
        "{name}:{why}\n{name} stays as it is and nothing was served; mend it, or move it away for a robot \
         as it comes from the factory"
    );
    Failure { exit: Exit::Usage, message, is_located: true }
}

/// The thread that writes.
struct Writer {
    work: Option<Sender<(usize, Kept)>>,
    /// What the disk refused.
    refusals: Receiver<(usize, String)>,
    thread: Option<JoinHandle<()>>,
}

impl Writer {
    fn start(directory: &Path) -> Self {
        let directory = directory.to_path_buf();
        let (work, jobs) = channel::<(usize, Kept)>();
        let (refuse, refusals) = channel();
        let thread = thread::spawn(move || {
            for (number, kept) in jobs {
                let path = file_of(&directory, number);
                if let Err(error) = write(&path, &kept) {
                    // Nobody listens any more: nobody is to be told.
                    let why = format!("--state: cannot write {}: {error}", path.display());
                    let _ = refuse.send((number, why));
                }
            }
        });
        Self { work: Some(work), refusals, thread: Some(thread) }
    }

    fn hand_over(&self, number: usize, kept: Kept) {
        if let Some(work) = &self.work {
            // The thread ends with this sender only.
            let _ = work.send((number, kept));
        }
    }

    fn refusals(&self) -> impl Iterator<Item = (usize, String)> + use<> {
        self.refusals.try_iter().collect::<Vec<_>>().into_iter()
    }

    /// Waits until all is written; what was refused and has not been tried again.
    fn end(mut self) -> Option<String> {
        self.work = None;
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            return Some("--state: the thread that writes has failed".into());
        }
        self.refusals().last().map(|(_, why)| why)
    }
}

/// Writes the file as a whole or not at all.
fn write(path: &Path, kept: &Kept) -> io::Result<()> {
    let aside = path.with_extension("json.new");
    let mut file = File::create(&aside)?;
    file.write_all(kept.written()?.as_bytes())?;
    file.sync_all()?;
    fs::rename(&aside, path)?;
    // The new name is on the disk once the directory is.
    path.parent().map_or(Ok(()), |directory| File::open(directory)?.sync_all())
}

#[cfg(test)]
mod tests {
    use super::super::cell::Bench;
    use super::*;
    use crate::wire::meca500::revision::Revision;

    /// A directory of one test, which is not there at its beginning.
    struct Scratch(PathBuf);

    impl Scratch {
        fn new(test: &str) -> Self {
            let name = format!("fieldarm-state-{}-{test}", std::process::id());
            let path = std::env::temp_dir().join(name);
            let _ = fs::remove_dir_all(&path);
            Self(path)
        }

        fn text(&self, robot: usize) -> String {
            fs::read_to_string(file_of(&self.0, robot)).expect("it was written")
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    /// Robots made as the state says.
    fn bench(state: &State, count: usize) -> Bench {
        let mut bench = Bench::of(Revision::R4, count);
        for (number, robot) in bench.robots.iter_mut().enumerate() {
            let mut settings = RobotSettings::default();
            state.furnish(number, &mut settings).expect("no mistake in it");
            let robot = robot.get_mut();
            *robot = VirtualRobot::new(settings);
            state.fill(number, robot).expect("no mistake in it");
        }
        bench
    }

    #[test]
    fn what_a_robot_was_told_is_there_again() {
        let scratch = Scratch::new("again");
        let state = State::open(&scratch.0.join("deep/inside"), 2).expect("it is made");
        let mut cell = bench(&state, 2);
        cell.robot(1).create_variable(10_000, &[1.0, 2.0]).expect("it is free");
        cell.robot(1).persistent_mut().calibration_enabled = false;
        state.end(&mut cell).expect("the disk has room");
        let state = State::open(&scratch.0.join("deep/inside"), 2).expect("it was closed");
        let mut cell = bench(&state, 2);
        assert_eq!(cell.robot(0).variables(), []);
        assert_eq!(cell.robot(1).variable(10_000), Some(&[1.0, 2.0][..]));
        assert!(!cell.robot(1).settings().persistent.calibration_enabled);
    }

    #[test]
    fn only_what_has_changed_is_written() {
        let scratch = Scratch::new("changed");
        let mut state = State::open(&scratch.0, 2).expect("it is made");
        let mut cell = bench(&state, 2);
        state.keep(&mut cell);
        state.end(&mut cell).expect("the disk has room");
        let before = scratch.text(0);
        // Whoever edits a file sees it overwritten only where the robot has changed.
        let edited = before.replace('\n', " ");
        fs::write(file_of(&scratch.0, 0), &edited).expect("it can be written");
        fs::write(file_of(&scratch.0, 1), &edited).expect("it can be written");
        let mut state = State::open(&scratch.0, 2).expect("it can be read");
        let mut cell = bench(&state, 2);
        for _ in 0..5 {
            assert_eq!(state.keep(&mut cell), None);
            cell.pass(INTERVAL);
        }
        cell.robot(0).create_variable(10_000, &[1.0]).expect("it is free");
        state.keep(&mut cell);
        state.end(&mut cell).expect("the disk has room");
        assert!(scratch.text(0).contains("10000") && scratch.text(0).contains('\n'));
        assert_eq!(scratch.text(1), edited);
    }

    #[test]
    fn one_process_at_a_time() {
        let scratch = Scratch::new("lock");
        let first = State::open(&scratch.0, 1).expect("nobody else is there");
        let refused = State::open(&scratch.0, 1).err().expect("never two at once");
        assert!(refused.message.contains("another process"), "{}", refused.message);
        drop(first);
        State::open(&scratch.0, 1).expect("the first has gone");
    }

    #[test]
    fn a_file_with_a_mistake_stays() {
        let scratch = Scratch::new("mistake");
        drop(State::open(&scratch.0, 1).expect("it is made"));
        let path = file_of(&scratch.0, 0);
        fs::write(&path, "{\n  \"fieldarm_robot_state\": 1,\n  \"serial")
            .expect("it can be written");
        let refused = State::open(&scratch.0, 1).err().expect("it is not whole");
        let begin = format!("{}:3:", path.display());
        assert!(refused.text().starts_with(&begin), "{}", refused.text());
        assert_eq!(refused.exit, Exit::Usage);
        assert!(scratch.text(0).ends_with("\"serial"));
    }

    #[test]
    fn the_file_of_another_robot_is_refused() {
        let scratch = Scratch::new("foreign");
        let mut state = State::open(&scratch.0, 1).expect("it is made");
        let mut cell = bench(&state, 1);
        state.keep(&mut cell);
        state.end(&mut cell).expect("the disk has room");
        let state = State::open(&scratch.0, 1).expect("it can be read");
        let mut settings = RobotSettings { serial_number: 5, ..RobotSettings::default() };
        let refused = state.furnish(0, &mut settings).expect_err("it is another's");
        assert!(refused.message.contains("serial number"), "{}", refused.message);
    }

    #[test]
    fn the_command_line_enables_what_it_serves() {
        let scratch = Scratch::new("enip");
        let state = State::open(&scratch.0, 1).expect("it is made");
        let mut cell = bench(&state, 1);
        state.end(&mut cell).expect("the disk has room");
        let state = State::open(&scratch.0, 1).expect("it can be read");
        use FieldbusMode::{Disabled, Enabled, MonitoringOnly};
        for (asked, becomes) in
            [(Disabled, Disabled), (Enabled, Enabled), (MonitoringOnly, MonitoringOnly)]
        {
            let mut settings = RobotSettings::default();
            settings.network.ethernet_ip = asked;
            let told = state.furnish(0, &mut settings).expect("no mistake");
            assert_eq!(settings.network.ethernet_ip, becomes);
            assert_eq!(told.is_some(), asked != Disabled);
        }
    }

    #[test]
    fn what_the_disk_refuses_is_told_once_and_tried_again() {
        let scratch = Scratch::new("refused");
        let mut state = State::open(&scratch.0, 1).expect("it is made");
        let mut cell = bench(&state, 1);
        // No file can take the place of a directory with something in it.
        let path = file_of(&scratch.0, 0);
        fs::create_dir_all(path.join("full")).expect("it can be made");
        let mut told = Vec::new();
        for _ in 0..1_000 {
            told.extend(state.keep(&mut cell));
            cell.pass(INTERVAL);
            thread::sleep(core::time::Duration::from_millis(1));
            if told.len() > 1 {
                break;
            }
        }
        assert_eq!(told.len(), 1, "{told:?}");
        assert!(told[0].contains("robot-1.json: "), "{told:?}");
        fs::remove_dir_all(&path).expect("it is there");
        state.end(&mut cell).expect("nothing is in the way any more");
        assert!(scratch.text(0).contains("serial_number"));
    }
}
