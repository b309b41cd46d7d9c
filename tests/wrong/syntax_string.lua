-- expect: 3: unfinished string near '"open'
local rd = require "refdyn"
local name = "open
return rd.model { name = name, links = {} }
