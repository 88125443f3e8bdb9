"""The bridge to ROS 1 robots, with a ROS 1 node made from parts of the standard library.

Pure: `frames` (the bytes of TCPROS), `answers` (the values of the XML-RPC interfaces), `publishers`
(the publishers of a topic, from answers and updates that may overtake each other), `goals` (the
goals of a bridged action), `backoff` (times of repetitions), `plan` (the names to bridge). With
threads and sockets: `links` (TCP connections), `rpc` (XML-RPC), `node` (a ROS 1 node), `topics`,
`services`, `actions` (one bridged name each), `bridge` (all of them).

Source:
    https://wiki.ros.org/ROS/TCPROS, https://wiki.ros.org/ROS/Connection%20Header,
    https://wiki.ros.org/ROS/Master_API and https://wiki.ros.org/ROS/Slave_API.
"""
