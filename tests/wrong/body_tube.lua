-- expect: 8: links[1].bodies[1].inner: inner diameter 0.2; must be less than the outer diameter, 0.1
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "psi",
      bodies = {
        rd.tube { outer = 0.1, inner = 0.2, length = 1, mass = 1 },
      } },
  },
}
