-- expect: 3: model pthread: pthread.h is a header of the system; choose another name
local rd = require "refdyn"
return rd.model {
  name = "pthread", gravity = { 0, 0, -9.81 },
  links = {
    { "arm", joint = "z", mass = 1 },
  },
}
