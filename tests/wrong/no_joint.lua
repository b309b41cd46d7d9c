-- expect: 3: links: no link has a joint, at least one coordinate is needed
local rd = require "refdyn"
return rd.model {
  name = "wrong", gravity = { 0, 0, -9.81 },
  links = {
    { "a", mass = 1 },
  },
}
