-- An arm with six turns about axes in any direction and a finger that slides: features of robots that textbook mechanisms
-- lack. The numbers vary randomly about those of a small industrial arm;
-- make_robot_references.py has the same ones.
local rd = require "refdyn"
local p = rd.parameters { { "tilt", 0.17 }, { "m_tool", 0.831, "kg" }, { "I_rotor", 1.37e-4, "kg m^2" } }
local across = { 0.12, 0.97, -0.05 } -- the shoulder and the elbow turn about parallel axes

return rd.model {
  name = "robot", gravity = { 0.31, -0.24, -9.79 },
  links = {
    { "pan", at = { 0.021, -0.013, 0.163 }, turn = { { "z", 0.21 } }, joint = "psi", start = { psi = 0.2 }, limits = { psi = { from = -2.9, to = 2.9, rate = 3.1, force = 150 } }, rotor = { psi = { inertia = p.I_rotor, gear = 101 } },
      mass = 3.761, center = { 0.007, -0.021, 0.013 }, inertia = { xx = 0.0121, yy = 0.0113, zz = 0.0094, xy = 0.0004, xz = -0.0003, yz = 0.0007 } },
    { "lift", on = "pan", at = { 0.013, 0.138, 0.004 }, turn = { { "y", 0.4 } }, joint = "theta", axis = across, start = { theta = -0.7 }, limits = { theta = { from = -0.9 } },
      rotor = { theta = { inertia = p.I_rotor, gear = -121 } },
      mass = 8.058, center = { 0.213, 0.011, 0.047 }, inertia = { xx = 0.031, yy = 0.142, zz = 0.131, xy = -0.002, xz = 0.006, yz = 0.001 } },
    { "elbow", on = "lift", at = { 0.425, -0.119, 0.008 }, joint = "theta", axis = across, start = { theta = 0.9 }, rotor = { theta = { inertia = p.I_rotor, gear = 101 } },
      mass = 2.846, center = { 0.151, -0.008, 0.012 }, inertia = { xx = 0.0051, yy = 0.0417, zz = 0.0401, xy = 0.0008, xz = -0.0012, yz = 0.0003 } },
    { "wrist_1", on = "elbow", at = { 0.392, 0.003, -0.011 }, joint = "theta", axis = { p.tilt, 0.9, 0.1 }, start = { theta = -0.3 },
      rotor = { theta = { inertia = 2.3e-5, gear = 80 } },
      mass = 1.371, center = { -0.006, 0.052, 0.017 }, inertia = { xx = 0.0026, yy = 0.0021, zz = 0.0029, xy = 0.0001, xz = 0.0002, yz = -0.0003 } },
    { "wrist_2", on = "wrist_1", at = { 0.004, 0.093, 0.002 }, joint = "psi", axis = { 0, 0, -1 }, start = { psi = 0.4 },
      mass = 1.298, center = { 0.003, 0.009, -0.041 }, inertia = { xx = 0.0024, yy = 0.0023, zz = 0.0018, xy = -0.0002, xz = 0.0001, yz = 0.0002 } },
    { "wrist_3", on = "wrist_2", at = { -0.002, 0.006, -0.095 }, joint = "phi", axis = { -0.3, 0.7, 0.2 }, start = { phi = 1.1 },
      rotor = { phi = { inertia = 0.013 } },
      mass = p.m_tool, center = { 0.002, 0.061, -0.004 }, inertia = { xx = 0.0011, yy = 0.0008, zz = 0.0013, xy = 0.0001, xz = -0.0001, yz = 0.0002 } },
    { "finger", on = "wrist_3", at = { 0.017, 0.112, 0.009 }, joint = "x", axis = { 0.3, -0.4, 0.5 }, start = { x = 0.012 }, limits = { x = { from = 0, to = 0.03, rate = 0.5 } },
      rotor = { x = { inertia = 3.1e-7, gear = 2094.4 } },
      mass = 0.173, center = { 0.004, 0.021, -0.002 }, inertia = { xx = 0.00012, yy = 0.00009, zz = 0.00011 } },
  },
  points = {
    E = { on = "wrist_3", at = { 0.011, 0.082, -0.017 }, turn = { { "z", 0.3 }, { "x", -0.4 } }, angular = true },
    grip = { on = "finger", at = { 0.003, 0.031, 0.002 }, angular = true },
  },
}
