-- expect: 4: option kind: value "c"; must be one of a, b
-- set: kind=c
local rd = require "refdyn"
local kind = rd.option("kind", "a", { "a", "b" })
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", joint = { "x" }, mass = 1 },
  },
}
