-- expect: 6: links[1].joint[2]: "x" is given twice; give it once
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x", "x" }, mass = 1 },
  },
}
