-- expect: 13: forces[1]: a table, the name of a coordinate before it, or rd.spring damper actuator force torque energy { ... } is needed
-- expect: 14: forces[2]: made by rd.loop, the name of a coordinate before it, or rd.spring damper actuator force torque energy { ... } is needed
-- expect: 15: forces[3]: a number, the name of a coordinate before it, or rd.spring damper actuator force torque energy { ... } is needed
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "psi" }, mass = 1, inertia = { zz = 1 } },
  },
  points = { E = "a" },
  forces = function(s)
    return {
      { a_x = 1 },
      rd.loop { "E", "ground" },
      5,
    }
  end,
}
