-- expect: 3: model Unistd: Unistd.h is a header of the system; choose another name
local rd = require "refdyn"
return rd.model {
  name = "Unistd", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
  },
}
