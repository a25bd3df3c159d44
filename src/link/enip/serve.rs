//! Robots on sockets.
