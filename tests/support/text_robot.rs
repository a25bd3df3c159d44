//! The virtual robot behind its ports, served by a thread.

#![allow(dead_code, reason = "each test binary uses a part of it")]

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use fieldarm::link::text::{Client, ClientOptions, Endpoints, TextServer};
use fieldarm::sim::meca500::VirtualRobot;

use crate::quick_robot::quick_robot;

/// Longer than anything here takes; what takes longer hangs.
const LONG: Duration = Duration::from_secs(30);

pub(crate) struct Robot {
    pub(crate) endpoints: Endpoints,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Robot {
    pub(crate) fn start() -> Self {
        let any = "127.0.0.1:0".parse().unwrap();
        let robot = VirtualRobot::new(quick_robot());
        let endpoints = Endpoints { control: any, monitoring: any };
        let mut server = TextServer::bind(robot, endpoints).unwrap();
        let endpoints = server.endpoints();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            while !stopped.load(Ordering::Relaxed) {
                server.step().unwrap();
            }
        });
        Self { endpoints, stop, thread: Some(thread) }
    }

    pub(crate) fn client(&self) -> Client {
        Client::connect(self.endpoints.control, ClientOptions::default()).unwrap()
    }

    /// A client whose robot is ready for motion, and quick.
    pub(crate) fn ready(&self) -> Client {
        let client = self.client();
        client.activate_robot().unwrap().wait(LONG).unwrap();
        client.home().unwrap().wait(LONG).unwrap();
        client.request("SetJointVel(100)", LONG).unwrap();
        client
    }
}

impl Drop for Robot {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let ended = self.thread.take().map(JoinHandle::join);
        if !std::thread::panicking() {
            assert!(matches!(ended, Some(Ok(()))), "the server's thread panicked");
        }
    }
}
