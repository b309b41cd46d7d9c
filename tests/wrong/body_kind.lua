-- expect: 9: rd.torus: unknown function, the nearest known one is "torque"
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "psi",
      bodies = {
        rd.position { 1 },
        rd.torus { mass = 1 },
      } },
  },
}
