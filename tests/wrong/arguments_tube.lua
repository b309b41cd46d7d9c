-- expect: 7: rd.tube: 2 arguments; must have 1, as in rd.tube { outer = 0.1, inner = 0.08, length = 1, mass = 1 }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "z",
      bodies = { rd.tube({ outer = 1, inner = 0.5, length = 1, mass = 1 }, "x") } },
  },
}
