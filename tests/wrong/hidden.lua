-- expect: 5: rd.modle: unknown function; did you mean "model"?
local rd = require "refdyn"
local list = __at(123456, {})
list.name = "x"
local m = rd.modle { __at(-1, list) }
