-- expect: 7: rd.tube: number of arguments is 2, 1 is needed; write rd.tube { outer = 0.1, inner = 0.08, length = 1, mass = 1 }
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = "z",
      bodies = { rd.tube({ outer = 1, inner = 0.5, length = 1, mass = 1 }, "x") } },
  },
}
