! usage: example_fortran. The dam break of example.c in Fortran with iso_c_binding, in this process.
! To build it against an installed PartiEMC, by pkg-config or CMake:
!
!   gfortran example.f90 $(pkg-config --libs partiemc-c) -o example_fortran
!
!   find_package(partiemc REQUIRED COMPONENTS c)
!   target_link_libraries(example_fortran PRIVATE partiemc::c)
program example
  use, intrinsic :: iso_c_binding
  implicit none
  integer(c_int32_t), parameter :: float64 = 2

  ! Structs of partiemc.h up to the last member used here; `size` gives their length.
  type, bind(c) :: partiemc_options
    integer(c_size_t) :: size
    real(c_double) :: spacing
  end type
  type, bind(c) :: partiemc_array
    type(c_ptr) :: first
    integer(c_ptrdiff_t) :: stride
    integer(c_int32_t) :: type
  end type
  type, bind(c) :: partiemc_particles
    integer(c_size_t) :: size, count
    type(partiemc_array) :: x, y
  end type
  type, bind(c) :: partiemc_event
    integer(c_size_t) :: size
    integer(c_int32_t) :: kind
    integer(c_int64_t) :: sequence
    real(c_double) :: time
    type(c_ptr) :: message, reason, field, value, rule
    integer(c_size_t) :: ring_count, point_count
    type(c_ptr) :: points, offsets, outer_of, rings, normals
    integer(c_size_t) :: mesh_point_count, triangle_count
    type(c_ptr) :: mesh_points, triangles, triangle_classes
    integer(c_int64_t) :: particle_count
    real(c_double) :: area, perimeter, spacing, cell_size, milliseconds
    integer(c_int64_t) :: rings_digest, mesh_digest
  end type

  interface
    integer(c_int32_t) function partiemc_open(address, options, stream) bind(c)
      import :: c_int32_t, c_ptr, partiemc_options
      type(c_ptr), value :: address
      type(partiemc_options), intent(in) :: options
      type(c_ptr), intent(out) :: stream
    end function
    integer(c_int32_t) function partiemc_reconstruct(stream, particles, time, event) bind(c)
      import :: c_int32_t, c_ptr, c_double, partiemc_particles, partiemc_event
      type(c_ptr), value :: stream
      type(partiemc_particles), intent(in) :: particles
      real(c_double), value :: time
      type(partiemc_event), intent(inout) :: event
    end function
    subroutine partiemc_close(stream) bind(c)
      import :: c_ptr
      type(c_ptr), value :: stream
    end subroutine
  end interface

  integer, parameter :: columns = 20, rows = 40, n = columns * rows
  real(c_double), target :: x(n), y(n)
  type(partiemc_options) :: options
  type(partiemc_particles) :: particles
  type(partiemc_event) :: event
  type(c_ptr) :: stream
  integer :: step, k

  options%size = c_sizeof(options)
  options%spacing = 0.01d0
  if (partiemc_open(c_null_ptr, options, stream) /= 0) error stop "partiemc_open"
  particles%size = c_sizeof(particles)
  particles%count = n
  particles%x = partiemc_array(c_loc(x), 8, float64)
  particles%y = partiemc_array(c_loc(y), 8, float64)
  event%size = c_sizeof(event)
  do step = 0, 4
    do k = 0, n - 1
      x(k + 1) = 0.01d0 * mod(k, columns) + 0.002d0 * step * (rows - k / columns) / 16
      y(k + 1) = 0.01d0 * (k / columns)
    end do
    if (partiemc_reconstruct(stream, particles, 0.1d0 * step, event) /= 0) error stop "reconstruct"
    print '(i0, a, i0, a, i0, a, f8.6, 2(1x, z16.16))', event%sequence, " rings ", &
      event%ring_count, " triangles ", event%triangle_count, " area ", event%area, &
      event%rings_digest, event%mesh_digest
  end do
  call partiemc_close(stream)
end program
