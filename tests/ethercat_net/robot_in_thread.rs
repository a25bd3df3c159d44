//! A robot with its witness, served at the robots' end of a cable by a thread of the test, which can
//! therefore look at what the robot took and pull its plug.

use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender, TryRecvError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use fieldarm::bus::ethercat::Settings;
use fieldarm::bus::ethercat::meca500::{Meca500Application, Meca500Settings};
use fieldarm::link::ethercat::raw_socket::{RawSocket, is_transient};
use fieldarm::link::ethercat::serve::{FrameCounts, Server};
use fieldarm::sim::meca500::{CyclicBus, RobotSettings};

use crate::ethercat_line::on_bus;
use crate::namespaces::{Cable, End, INTERFACE};
use crate::watched::WatchedRobot;

/// Far longer than anything here takes.
const LONG: Duration = Duration::from_secs(20);

type Act = Box<dyn FnOnce(&mut WatchedRobot) + Send>;

/// The thread and the way to its robot.
pub(crate) struct RobotInThread {
    acts: Sender<Act>,
    thread: JoinHandle<FrameCounts>,
}

impl RobotInThread {
    /// Serves one robot until [`end`](Self::end).
    pub(crate) fn serve(cable: &Cable, robot: RobotSettings) -> Self {
        let socket = cable.inside(End::Robots, LONG, || RawSocket::open(INTERFACE));
        let device = WatchedRobot::new(RobotSettings { bus: CyclicBus::EtherCat, ..robot });
        let device = on_bus(device, 0, Meca500Settings::default(), Settings::default());
        let server = Server::new(socket.expect("root opens it"), vec![device]);
        let (acts, acting) = mpsc::channel();
        Self { acts, thread: thread::spawn(move || serve(server, &acting)) }
    }

    /// Has `act` done to the robot as soon as it can be.
    pub(crate) fn tell(&self, act: impl FnOnce(&mut WatchedRobot) + Send + 'static) {
        self.acts.send(Box::new(act)).expect("the robot is served");
    }

    /// What `look` finds at the robot.
    pub(crate) fn ask<T: Send + 'static>(
        &self,
        look: impl FnOnce(&mut WatchedRobot) -> T + Send + 'static,
    ) -> T {
        let (found, finding) = mpsc::channel();
        self.tell(move |robot| {
            let _ = found.send(look(robot));
        });
        match finding.recv_timeout(LONG) {
            Ok(found) => found,
            Err(RecvTimeoutError::Timeout) => panic!("the robot's thread hangs"),
            Err(RecvTimeoutError::Disconnected) => panic!("the robot's thread has ended"),
        }
    }

    /// Ends the serving; what passed.
    pub(crate) fn end(self) -> FrameCounts {
        drop(self.acts);
        self.thread.join().expect("a robot never panics")
    }
}

fn serve(
    mut server: Server<RawSocket, Meca500Application<WatchedRobot>>,
    acting: &Receiver<Act>,
) -> FrameCounts {
    loop {
        match acting.try_recv() {
            Ok(act) => act(server.line_mut()[0].application_mut().device_mut()),
            Err(TryRecvError::Disconnected) => return server.counts(),
            Err(TryRecvError::Empty) => {
                // An error is a link that is down: it comes up again.
                if let Err(error) = server.step() {
                    assert!(is_transient(&error), "{error}");
                }
            }
        }
    }
}
