-- expect: 3: unfinished string near '"a\x1B[31m'
local rd = require "refdyn"
local x = "a[31m
